"""The environment as a `gymnasium.vector.VectorEnv`: a batch of races in one compiled call a lap."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from gymnasium.spaces import Discrete, MultiDiscrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from rsrl.environment.gymnasium_env import chosen_seed, make_environment, observation_space, outcome_columns, refuse_options
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.state import Action

Floats = NDArray[np.float32]
Bools = NDArray[np.bool_]

AUTORESET_MODES: Final = (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)


class RaceVectorEnv(VectorEnv[Floats, NDArray[np.integer[Any]], NDArray[Any]]):
    """`num_envs` races side by side: `gymnasium.make_vec("rsrl/Race-v0", num_envs=64, race="bahrain-2023")`.

    Row `i` of a batch of `n` runs the races numbered i, i + n, i + 2n ... of the seed, independently of the other rows. Races that end
    are followed by the next in one of two ways of Gymnasium:

    - `AutoresetMode.NEXT_STEP`: the step that ends a race returns its last observation; the step after it ignores that race's action,
      starts its next race and gives reward 0.
    - `AutoresetMode.SAME_STEP`: the step that ends a race returns the first observation of the next one. The last observation of the race
      that ended is in `final_obs` (object array, None where no race ended), its last info in `final_info`.

    Attributes:
        info: as of `RaceEnv`, each value an array [num_envs] with a mask of the same name after an underscore.

    Args:
        num_envs: races side by side.
        race, driver, feature_set: as of `RaceEnv`.
        autoreset_mode: one of the two above, or its value such as `"SameStep"`.
        render_mode: None; pictures are drawn of single races only.

    Raises:
        RsrlError: as `RaceEnv`, fewer than one race side by side, or another mode.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012  # as Gymnasium declares it

    def __init__(
        self,
        num_envs: int = 1,
        race: str | Path | RaceRecord = "bahrain-2023",
        driver: str | int | None = None,
        feature_set: str = "full",
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        if num_envs < 1:
            raise RsrlError(f"num_envs is {num_envs}; ask for one race at least")
        if render_mode is not None:
            raise RsrlError(f"render_mode is {render_mode!r}, but races side by side are not drawn; use gymnasium.make for one race")
        self._same_step = _autoreset_mode(autoreset_mode) is AutoresetMode.SAME_STEP
        self.metadata = type(self).metadata | {"autoreset_mode": _autoreset_mode(autoreset_mode)}
        self.num_envs = num_envs
        self.environment = make_environment(race, driver, feature_set, batch=num_envs)
        self.single_observation_space = observation_space(feature_set)
        self.single_action_space = Discrete(len(Action))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = MultiDiscrete(np.full(num_envs, len(Action)))
        self._seed: int | None = None
        self._races = np.arange(num_envs, dtype=np.int64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Start all races. Raises RsrlError for options, of which there are none, and for more than one seed."""
        if isinstance(seed, list | tuple):
            raise RsrlError("give one seed for all races; their numbers distinguish them")
        super().reset(seed=seed)
        refuse_options(options)
        if seed is not None or self._seed is None:
            self._seed, self._races = chosen_seed(seed, self.np_random), np.arange(self.num_envs, dtype=np.int64)
        observation = self.environment.reset(self._seed, self._races)
        self._races = self._races + self.num_envs
        return observation.features.copy(), self._infos(np.zeros(self.num_envs, np.bool_))

    def step(self, actions: NDArray[np.integer[Any]]) -> tuple[Floats, Floats, Bools, Bools, dict[str, Any]]:
        """Call the coming lap of every race. Raises RsrlError for actions that are not 0 to 3, and before the first reset."""
        if self._seed is None:
            raise RsrlError("the races were never started; call reset() first")
        calls = self._checked(actions)
        over = self.environment.done.copy()
        t = self.environment.step(calls)
        reward, ended = t.reward.copy(), t.terminated & ~over
        infos = self._infos(ended)
        features, restarted = t.features, ended if self._same_step else over
        if restarted.any():
            if self._same_step:
                infos = _final(t.features, infos, ended)
            features = self._restart(np.flatnonzero(restarted))
            infos["action_mask"], infos["_action_mask"] = self._mask()
        return features.copy(), reward, ended, np.zeros(self.num_envs, np.bool_), infos

    def _checked(self, actions: NDArray[np.integer[Any]]) -> NDArray[np.int8]:
        calls = np.asarray(actions)
        whole = calls.shape == (self.num_envs,) and np.issubdtype(calls.dtype, np.integer)
        if not whole or calls.min() < 0 or calls.max() >= len(Action):
            raise RsrlError(f"actions must be {self.num_envs} whole numbers from 0 to {len(Action) - 1}, found {actions!r}")
        return calls.astype(np.int8)

    def _restart(self, rows: NDArray[np.intp]) -> Floats:
        assert self._seed is not None
        observation = self.environment.reset_rows(self._seed, self._races[rows], rows.astype(np.int64))
        self._races[rows] += self.num_envs
        return observation.features

    def _infos(self, ended: Bools) -> dict[str, Any]:
        infos: dict[str, Any] = dict(zip(("action_mask", "_action_mask"), self._mask(), strict=True))
        if ended.any():
            for name, values in outcome_columns(self.environment.outcome()).items():
                infos[name] = np.where(ended, values, np.zeros_like(values))
                infos[f"_{name}"] = ended.copy()
        return infos

    def _mask(self) -> tuple[NDArray[np.int8], Bools]:
        """Legal calls int8 [num_envs, 4], and that every race has them."""
        return self.environment.legal.astype(np.int8), np.ones(self.num_envs, np.bool_)


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    for known in AUTORESET_MODES:
        if mode in (known, known.value):
            return known
    raise RsrlError(f"autoreset_mode is {mode!r}; there are {', '.join(repr(known.value) for known in AUTORESET_MODES)}")


def _final(features: Floats, infos: dict[str, Any], ended: Bools) -> dict[str, Any]:
    """Last observations and infos of the races that ended, as Gymnasium's own vector environments name them in same-step mode."""
    observations = np.full(len(ended), None, object)
    for i in np.flatnonzero(ended):
        observations[i] = features[i].copy()
    infos["action_mask"] = np.where(ended[:, None], infos["action_mask"], 0).astype(np.int8)
    infos["_action_mask"] = ended.copy()
    return {"final_obs": observations, "_final_obs": ended.copy(), "final_info": infos, "_final_info": ended.copy()}
