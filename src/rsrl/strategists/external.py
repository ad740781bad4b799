"""Policies from elsewhere as strategists: a function of observation and mask, or a file of Stable-Baselines3.

Such a policy gives calls without values. A call that is not legal is made all the same, as in the environment, and may end the race.
"""

import importlib
import json
import os
import re
import sys
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.state import FEATURE_SETS, Action, Encoder, input_names
from rsrl.strategists.interface import Strategist

Floats = NDArray[np.float32]
Bools = NDArray[np.bool_]

BatchCaller = Callable[[Floats, Bools, Any], tuple[Any, Any]]
"""Calls [B] and the memory for the next lap, from observations float32 [B, F], legal calls bool [B, 4] and a memory, None at the start."""

FUNCTION: Final = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
SB3_FILE: Final = ".zip"
SB3_CLASSES: Final[Mapping[str, tuple[str, str]]] = {
    "stable_baselines3.dqn.policies": ("stable_baselines3", "DQN"),
    "sb3_contrib.qrdqn.policies": ("sb3_contrib", "QRDQN"),
    "sb3_contrib.common.maskable.policies": ("sb3_contrib", "MaskablePPO"),
    "sb3_contrib.common.recurrent.policies": ("sb3_contrib", "RecurrentPPO"),
}
"""Library and algorithm by the module of the policy class that a file names; those of PPO, A2C and TRPO share one."""

SB3_ACTOR_CRITIC: Final = "stable_baselines3.common.policies"


@dataclass(frozen=True)
class ExternalPolicy:
    """A policy from elsewhere.

    Attributes:
        kind: what tables call it: the function as typed, or the algorithm of the file.
        feature_set: of its observations.
        caller: makes the calls.
        recurrent: whether it has a memory of the laps before.
        batch_invariant: as of `Strategist`.
    """

    kind: str
    feature_set: str
    caller: BatchCaller
    recurrent: bool = False
    batch_invariant: bool = False

    def encoder(self, record: RaceRecord) -> Encoder:
        """The encoder from raw rows to its observations, for one race."""
        return Encoder(self.feature_set, record.scaling)

    def calls(self, observations: Floats, legal: Bools, memory: Any) -> tuple[NDArray[np.int8], Any]:
        """Calls int8 [B] and the memory for the next lap.

        Raises:
            RsrlError: what the policy returns is not one call of 0 to 3 for each observation.
        """
        answer, memory = self.caller(observations, legal, memory)
        calls = np.asarray(answer)
        whole = calls.shape == (len(observations),) and np.issubdtype(calls.dtype, np.integer)
        if not whole or (calls.size and not 0 <= calls.min() <= calls.max() < len(Action)):
            raise RsrlError(f"{self.kind}: found {answer!r}; it must call 0 to stay out, 1, 2 or 3 to box for soft, medium or hard")
        return calls.astype(np.int8), memory


class ExternalPolicyStrategist(Strategist):
    """Calls with a policy from elsewhere, on its own feature set whatever the environment's."""

    def __init__(self, policy: ExternalPolicy, record: RaceRecord, name: str) -> None:
        self.name = name
        self.batch_invariant = policy.batch_invariant
        self._policy, self._encoder = policy, policy.encoder(record)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start with an empty memory."""
        self._memory: Any = None

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The policy's calls; in a race that is over the call means nothing."""
        calls, self._memory = self._policy.calls(self._encoder(environment.raw), environment.legal.copy(), self._memory)
        return calls


def is_external(name: str) -> bool:
    """Whether a name is that of a file of Stable-Baselines3 (`.zip`) or of a function (`module:function`)."""
    return name.endswith(SB3_FILE) or FUNCTION.fullmatch(name) is not None


def load_external(name: str) -> ExternalPolicy:
    """The policy that `model.zip` or `module:function` names; a file is loaded, which runs code in it: trust whom it comes from.

    Raises:
        RsrlError: there is no such file or function, the library is not installed, or its observations are not this environment's.
    """
    return load_sb3(Path(name)) if name.endswith(SB3_FILE) else of_function(_found_function(name), name)


def of_function(function: Callable[[Floats, NDArray[np.int8]], int], name: str) -> ExternalPolicy:
    """A function of one observation float32 [F] and its action mask int8 [4] that returns the call, 0 to 3.

    The observation is that of the feature set `full`, unless the function has an attribute `feature_set` that names another.
    """

    def row_by_row(observations: Floats, legal: Bools, memory: Any) -> tuple[list[int], None]:
        masks = legal.astype(np.int8)
        return [function(x.copy(), mask) for x, mask in zip(observations, masks, strict=True)], None

    feature_set = getattr(function, "feature_set", "full")
    if feature_set not in FEATURE_SETS:
        raise RsrlError(f"{name}: its feature_set is {feature_set!r}; there are {', '.join(FEATURE_SETS)}")
    return ExternalPolicy(name, feature_set, row_by_row, batch_invariant=True)


def _found_function(name: str) -> Callable[..., int]:
    """The function of a module, which may lie in the working folder."""
    module_name, _, attribute = name.partition(":")
    before = list(sys.path)
    sys.path.insert(0, os.getcwd())
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        raise RsrlError(f"{name}: module {module_name} cannot be imported ({error})") from None
    finally:
        sys.path[:] = before
    function = getattr(module, attribute, None)
    if not callable(function):
        raise RsrlError(f"{name}: module {module_name} has no function {attribute}")
    found: Callable[..., int] = function
    return found


def load_sb3(path: Path) -> ExternalPolicy:
    """A model saved by Stable-Baselines3 or its contributions, called without exploration.

    Raises:
        RsrlError: as `load_external`.
    """
    library, algorithm = _sb3_class(path)
    try:
        module = importlib.import_module(library)
    except ImportError:
        raise RsrlError(f"{path}: a {algorithm} of Stable-Baselines3; install it first: pip install {library.replace('_', '-')}") from None
    model = getattr(module, algorithm).load(path, device="cpu")
    masked = algorithm == "MaskablePPO"

    def predict(observations: Floats, legal: Bools, memory: Any) -> tuple[Any, Any]:
        more = {"action_masks": legal} if masked else {}
        first = np.full(len(observations), memory is None)
        return model.predict(observations, state=memory, episode_start=first, deterministic=True, **more)

    feature_set = _feature_set_of(path, getattr(model.observation_space, "shape", None), getattr(model.action_space, "n", None))
    return ExternalPolicy(algorithm, feature_set, predict, recurrent=algorithm == "RecurrentPPO")


def _sb3_class(path: Path) -> tuple[str, str]:
    """Library and name of the algorithm that saved a file, from its description; nothing in the file is run."""
    try:
        with zipfile.ZipFile(path) as archive:
            about = json.loads(archive.read("data"))
        policy_module = str(about["policy_class"]["__module__"])
    except FileNotFoundError:
        raise RsrlError(f"{path}: no such file") from None
    except (OSError, zipfile.BadZipFile, KeyError, TypeError, ValueError):
        raise RsrlError(f"{path}: not a model saved by Stable-Baselines3") from None
    if policy_module == SB3_ACTOR_CRITIC:
        return ("sb3_contrib", "TRPO") if "cg_max_steps" in about else ("stable_baselines3", "PPO" if "clip_range" in about else "A2C")
    if policy_module not in SB3_CLASSES:
        raise RsrlError(f"{path}: its policy is of {policy_module}, which RSRL does not know; call it from a function, module:function")
    return SB3_CLASSES[policy_module]


def _feature_set_of(path: Path, shape: tuple[int, ...] | None, actions: int | None) -> str:
    """The feature set with so many columns."""
    widths = {(len(input_names(name)),): name for name in FEATURE_SETS}
    if shape not in widths or actions != len(Action):
        sizes = ", ".join(f"{width[0]} ({name})" for width, name in widths.items())
        raise RsrlError(f"{path}: reads observations {shape} and makes {actions} calls; rsrl/Race-v0 has 4 calls and {sizes} columns")
    return widths[shape]
