"""The environment of the paper, vectorised: races side by side, one decision a lap for one car of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import kernels
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, RaceBatch, Rivals, compile_figures
from rsrl.simulator import layout as at
from rsrl.state import RAW_SIZE, Encoder, Observer


class Observation(NamedTuple):
    """What a policy sees: features float32 [B, F], scaled and one-hot; legal bool [B, 4]."""

    features: NDArray[np.float32]
    legal: NDArray[np.bool_]


class Transition(NamedTuple):
    """What a step gives: the next observation, reward float32 [B], terminated and truncated bool [B]."""

    features: NDArray[np.float32]
    legal: NDArray[np.bool_]
    reward: NDArray[np.float32]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]


class EnvironmentOptions(TypedDict, total=False):
    """Keyword arguments of `RaceEnvironment` that other environments pass on; described there."""

    feature_set: str
    batch: int
    rivals: Rivals | None


@dataclass(frozen=True)
class Outcome:
    """How the races of a batch ended for the called car; arrays [B], valid where the race is over."""

    position: NDArray[np.int64]  # finishing position, 1 for the winner; of a failed call as `kernels.last_place`
    valid: NDArray[np.bool_]  # tyre rules met (two compounds, sets to be used) and no call failed
    retired: NDArray[np.bool_]
    stops: NDArray[np.int64]
    failed: NDArray[np.bool_]  # called for a compound without a set left


class RaceEnvironment:
    """`batch` races that advance together. Returned arrays are reused by the next call: copy them to keep them.

    Attributes:
        laps: decisions in a race.
        raw: raw feature rows float32 [B, RAW_SIZE], natural units.
        legal: bool [B, 4].
        done: bool [B], races that are over.

    Args:
        record: the race.
        car: index of the called car.
        feature_set: `full`, `named` or `paper`.
        batch: races side by side.
        plans: plans of other cars, by car index.
        rivals: how the cars without a plan decide; None for `reactive` where the record has the figures, else `plans`.
        outside: further cars called from outside, through `races.actions`.
    """

    def __init__(
        self,
        record: RaceRecord,
        car: int,
        *,
        feature_set: str = "full",
        batch: int = 1,
        plans: Mapping[int, Plan] | None = None,
        rivals: Rivals | None = None,
        outside: Sequence[int] = (),
    ) -> None:
        self.record, self.car = record, car
        self.laps = record.laps
        self.encoder = Encoder(feature_set, record.scaling)
        self.observer = Observer(record, car)
        self.races = RaceBatch(compile_figures(record), batch, outside=(car, *outside), plans=plans, rivals=rivals)
        self.raw = np.zeros((batch, RAW_SIZE), np.float32)
        self.legal = np.zeros((batch, 4), np.bool_)
        self.done = np.ones(batch, np.bool_)
        self._features = np.zeros((batch, self.encoder.width), np.float32)
        self._reward = np.zeros(batch, np.float32)
        self._outcome = np.zeros((batch, kernels.O_SIZE), np.float32)
        self._positions = np.zeros(at.CARS, np.int8)
        self._truncated = np.zeros(batch, np.bool_)
        self._all = np.arange(batch, dtype=np.int64)

    @property
    def batch(self) -> int:
        """Races side by side."""
        return len(self.done)

    @property
    def feature_set(self) -> str:
        """Name of the feature set."""
        return self.encoder.feature_set

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Names of the feature columns."""
        return self.encoder.names

    @property
    def n_features(self) -> int:
        """Feature columns."""
        return self.encoder.width

    def reset(self, seed: int, races: NDArray[np.int64]) -> Observation:
        """Start races number `races` int64 [B] of `seed`; the two determine everything random in a race."""
        return self.reset_rows(seed, races, self._all)

    def reset_rows(self, seed: int, races: NDArray[np.int64], rows: NDArray[np.int64]) -> Observation:
        """Restart some rows of the batch; the others go on. Returns the observation of the whole batch."""
        b, o = self.races, self.observer
        kernels.reset_rows(
            b.figures, b.table, seed, races, b.callers, b.f, b.k, b.r, rows, self.car, o.context,
            self.raw, self.legal, self.done, self._outcome,
        )  # fmt: skip
        return Observation(self.encoder(self.raw, self._features), self.legal)

    def step(self, actions: NDArray[np.int8]) -> Transition:
        """Call every race: actions int8 [B], 0 stay out, 1 soft, 2 medium, 3 hard. A race that is over ignores its call."""
        b, o = self.races, self.observer
        kernels.step_rows(
            b.figures, b.table, b.f, b.k, b.r, actions, b.actions, self.car, o.context,
            self.raw, self.legal, self.done, self._reward, self._outcome, self._positions,
        )  # fmt: skip
        return Transition(self.encoder(self.raw, self._features), self.legal, self._reward, self.done, self._truncated)

    def outcome(self) -> Outcome:
        """How the races ended, copied."""
        o = self._outcome
        return Outcome(
            o[:, kernels.O_POSITION].astype(np.int64),
            o[:, kernels.O_VALID] > 0,
            o[:, kernels.O_RETIRED] > 0,
            o[:, kernels.O_STOPS].astype(np.int64),
            o[:, kernels.O_FAILED] > 0,
        )
