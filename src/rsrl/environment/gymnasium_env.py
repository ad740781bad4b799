"""The environment as a `gymnasium.Env`: one race at a time. gymnasium_vector_env.py has the vectorised one."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray

from rsrl.compile_watch import announce
from rsrl.environment.gymnasium_render import RENDER_MODES, Frame, RaceDisplay
from rsrl.environment.race_environment import Outcome, RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car, load_race
from rsrl.state import Action, feature_set

SEEDS = 2**31
"""An environment that is never given a seed draws one below this."""


class RaceEnv(gymnasium.Env[NDArray[np.float32], int]):
    """One race, one decision a lap for one car: `gymnasium.make("rsrl/Race-v0", race="bahrain-2023", driver="HAM")`.

    `reset(seed=s)` starts race 0 of seed `s`, every later `reset()` the next race of that seed; seed and race number
    determine everything random in a race. A race ends (`terminated`) at the flag, with the car's retirement, or with a call for a
    compound without a set left; it is never `truncated`.

    Attributes:
        info: `action_mask` int8 [4], 1 for the legal calls; after the last step also `position`, `valid`, `retired`,
            `stops` and `failed`, as in `Outcome`.

    Args:
        race: name of a race, path of a season file, or a record.
        driver: code, number or surname; None for the race's default driver.
        feature_set: `full`, `named` or `paper`.
        render_mode: `ansi` for a line of text a lap, `rgb_array` for the race trace so far as a picture uint8 [320, 480, 3]; None for
            neither.

    Raises:
        RsrlError: no such race, driver, feature set or render mode, or a wet race.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 5}  # noqa: RUF012  # as Gymnasium declares it

    def __init__(
        self,
        race: str | Path | RaceRecord = "bahrain-2023",
        driver: str | int | None = None,
        feature_set: str = "full",
        render_mode: str | None = None,
    ) -> None:
        self.environment = make_environment(race, driver, feature_set, batch=1)
        self.render_mode = render_mode
        self._display = None if render_mode is None else RaceDisplay(self.environment, render_mode)
        self.observation_space = observation_space(feature_set)  # type: ignore[assignment]  # Gymnasium leaves the dtype open
        self.action_space = Discrete(len(Action))  # type: ignore[assignment]  # int64, as actions are
        self._seed: int | None = None
        self._race = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start a race. Raises RsrlError for options, of which there are none."""
        super().reset(seed=seed)
        refuse_options(options)
        if seed is not None or self._seed is None:
            self._seed, self._race = chosen_seed(seed, self.np_random), 0
        observation = self.environment.reset(self._seed, np.array([self._race], np.int64))
        self._race += 1
        if self._display:
            self._display.start()
        return observation.features[0].copy(), {"action_mask": self._mask()}

    def step(self, action: int) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Call the coming lap. Raises RsrlError for an action that is not 0 to 3, and after the end of a race."""
        if not self.action_space.contains(action):
            raise RsrlError(f"action is {action!r}; call 0 to stay out, 1, 2 or 3 to box for soft, medium or hard")
        if self.environment.done[0]:
            raise RsrlError("the race is over or was never started; call reset() first")
        t = self.environment.step(np.array([action], np.int8))
        terminated = bool(t.terminated[0])
        if self._display:
            self._display.lap(int(action))
        info: dict[str, Any] = {"action_mask": self._mask()}
        if terminated:
            info |= {name: values[0].item() for name, values in outcome_columns(self.environment.outcome()).items()}
        return t.features[0].copy(), float(t.reward[0]), terminated, False, info

    def render(self) -> Frame | None:
        """The last lap as a line of text or the race so far as a picture, by `render_mode`; None without one.

        Raises:
            RsrlError: no race has been started.
        """
        if self._seed is None:
            raise RsrlError("there is no race to show; call reset() first")
        return self._display.show() if self._display else None

    def action_masks(self) -> NDArray[np.bool_]:
        """Legal calls, bool [4]; the method that masked learners such as those of sb3-contrib look for."""
        return self.environment.legal[0].copy()

    def _mask(self) -> NDArray[np.int8]:
        return self.environment.legal[0].astype(np.int8)


def race_and_car(race: str | Path | RaceRecord, driver: str | int | None) -> tuple[RaceRecord, int]:
    """A race's record and the index of a driver's car, from whatever names them.

    Args:
        race: name of a race, path of a season file, or a record.
        driver: code, number or surname; None for the race's default driver.

    Raises:
        RsrlError: no such race or driver.
    """
    record = race if isinstance(race, RaceRecord) else load_race(str(race))
    return record, find_car(record, None if driver is None else str(driver))


def make_environment(race: str | Path | RaceRecord, driver: str | int | None, feature_set: str, batch: int) -> RaceEnvironment:
    """The environment behind a Gymnasium one; its first compiling is announced. Raises RsrlError for an unknown name."""
    announce()
    return RaceEnvironment(*race_and_car(race, driver), feature_set=feature_set, batch=batch)


def observation_space(name: str) -> Box:
    """Range of each column of the network input of a feature set: 0 to 1, or -1 to 1."""
    low = [f.low for f in feature_set(name) for _ in range(f.width)]
    return Box(np.array(low, np.float32), np.ones(len(low), np.float32), dtype=np.float32)


def chosen_seed(seed: int | None, rng: np.random.Generator) -> int:
    """The seed given, or a drawn one. Raises RsrlError for one that does not fit 63 bits."""
    if seed is None:
        return int(rng.integers(SEEDS))
    if seed >= 2**63:
        raise RsrlError(f"seed is {seed}; it must be below 2^63")
    return int(seed)


def refuse_options(options: dict[str, Any] | None) -> None:
    """Raise RsrlError for options of a reset: a race is named when the environment is made."""
    if options:
        raise RsrlError(f"reset takes no options, found {', '.join(sorted(options))}; race, driver and feature_set are given to make()")


def outcome_columns(outcome: Outcome) -> dict[str, NDArray[Any]]:
    """What `info` says of finished races, by name, each [B]."""
    return {name: getattr(outcome, name) for name in ("position", "valid", "retired", "stops", "failed")}
