"""A policy as a strategist, and how policies are found: run folders, those shipped, those from elsewhere."""

import hashlib
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import Agent, ModelMetadata, NetworkAgent, load_agent
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.state import FIGURES, Encoder, context_figures, input_names
from rsrl.strategists.external import ExternalPolicy, ExternalPolicyStrategist, is_external, load_external
from rsrl.strategists.interface import Strategist


class PolicyStrategist(Strategist):
    """Calls with a trained agent, on the agent's own feature set whatever the environment's.

    Raises:
        RsrlError: the agent was trained on another feature schema than this version of RSRL has.
    """

    def __init__(self, agent: Agent, record: RaceRecord, name: str = "model") -> None:
        self.name = name
        if tuple(agent.feature_names) != input_names(agent.feature_set):
            raise RsrlError(f"{name}: trained on another version of the {agent.feature_set!r} features; train the model again")
        self._agent = agent
        self._encoder = Encoder(agent.feature_set, record.scaling)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start with an empty memory."""
        self._memory = self._agent.initial_memory(len(races))

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The agent's greedy call. An agent trained without the mask, as the paper's are, may make illegal calls."""
        calls, self._memory = self._agent.act(self._encoder(environment.raw), environment.legal, self._memory)
        return calls


def outside_training(about: ModelMetadata, record: RaceRecord, car: int) -> list[str]:
    """One readable line for each figure of a race and car outside the policy's training range; empty where all are inside.

    The policy still calls such a race, but it extrapolates.
    """
    if not about.trained_range:
        return []
    lines = []
    for feature, value in zip(FIGURES, context_figures(record, car), strict=True):
        low, high = about.trained_range[feature.name]
        if not low <= value <= high:
            lines.append(f"{feature.text} is {value:.3g} {feature.unit}, the policy was trained on {low:.3g} to {high:.3g}")
    return lines


def policies_folder() -> Path:
    """The folder of the policies shipped with the package; each has a folder of its own."""
    return Path(str(files("rsrl.agents"))) / "policies"


def is_model(name: str) -> bool:
    """Whether `name` is a folder, a shipped policy, or a policy from elsewhere."""
    return Path(name).is_dir() or is_shipped(name) or is_external(name)


def is_shipped(name: str) -> bool:
    """Whether `name` is that of a policy shipped with the package."""
    return "/" not in name and "\\" not in name and (policies_folder() / name).is_dir()


def find_model(model: str) -> Path:
    """Folder of a model: a run folder's path, or the name of a shipped policy such as `bahrain-2023`.

    Raises:
        RsrlError: it is neither.
    """
    if Path(model).is_dir():
        return Path(model)
    shipped = policies_folder()
    if is_shipped(model):
        return shipped / model
    if is_external(model):
        raise RsrlError(f"{model}: a policy from elsewhere, which only `rsrl evaluate` and `rsrl explain` take")
    known = ", ".join(sorted(p.name for p in shipped.iterdir() if p.is_dir())) if shipped.is_dir() else ""
    raise RsrlError(f"no model {model!r}: neither a run folder made by `rsrl train` nor a shipped policy ({known or 'none shipped'})")


def load_policy(model: str) -> tuple[NetworkAgent | ExternalPolicy, ModelMetadata]:
    """A policy and what is known of its training, nothing for one from elsewhere.

    Args:
        model: as of `find_model`, or a policy from elsewhere: `model.zip` of Stable-Baselines3, or `module:function`.

    Raises:
        RsrlError: there is none, or it cannot be read.
    """
    if not Path(model).is_dir() and is_external(model):
        return load_external(model), ModelMetadata()
    return load_agent(find_model(model))


def strategist_of(policy: Agent | ExternalPolicy, record: RaceRecord, name: str) -> Strategist:
    """A policy as a strategist for one race. Raises RsrlError as `PolicyStrategist`."""
    if isinstance(policy, ExternalPolicy):
        return ExternalPolicyStrategist(policy, record, name)
    return PolicyStrategist(policy, record, name)


def weights_hash(agent: NetworkAgent) -> str:
    """First 16 hex digits of the SHA-256 of the feature names and of the weights in order of their names."""
    digest = hashlib.sha256("\n".join((agent.feature_set, *agent.feature_names)).encode())
    for name in sorted(agent.params):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(agent.params[name]).tobytes())
    return digest.hexdigest()[:16]
