"""The one recorder of driven races: a strategist calls races of one car, and every step of them is kept.

A race is an episode, a lap is a step. Who drives and who labels the states are separate choices: the policy under explanation drives and
labels its own races, but when a tree is fitted (DAgger, VIPER) the tree drives and the policy labels every state that the tree reaches.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rsrl.environment import Outcome, RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.explanation.moment import Arrays, Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, FEATURES
from rsrl.strategists import Strategist

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
Calls = NDArray[np.int8]

MOST_TRIED: Final = 100
"""Races tried to find one that the car finishes."""

CONTINUOUS: Final = np.array([COLUMN[f.name] for f in FEATURES if f.kind == "continuous"])


class RaceOverError(RsrlError):
    """A lap was asked for that the car does not reach."""


@dataclass(frozen=True)
class Postponed:
    """The lap after each step, had every stop called on that step been postponed.

    Attributes:
        raw, legal, q: as in `Episodes`, one lap later; meaningful where `running`.
        running: bool [T, R], a stop was called on the step and the race goes on without it.
    """

    raw: Floats
    legal: Flags
    q: Floats
    running: Flags


@dataclass(frozen=True)
class Episodes:
    """Races of one car side by side: T steps (laps), R races. After the end of a race its rows carry no information.

    Attributes:
        record, car, seed: whose races; races: their numbers, int64 [R].
        raw: raw feature rows before each call, float32 [T, R, RAW_SIZE].
        legal: bool [T, R, 4].
        running: bool [T, R], the race goes on.
        calls: int8 [T, R], as driven.
        rewards: float32 [T, R].
        q: action values of the labelling policy, float32 [T, R, 4]; NaN without one.
        labels: its greedy calls, int8 [T, R]; -1 without one.
        outcome: how the races ended.
        states: the simulator's f, k, r before each call, [T, R, ...]; None unless asked for.
        postponed: None unless asked for.
    """

    record: RaceRecord
    car: int
    seed: int
    races: NDArray[np.int64]
    raw: Floats
    legal: Flags
    running: Flags
    calls: Calls
    rewards: Floats
    q: Floats
    labels: Calls
    outcome: Outcome
    states: Arrays | None = None
    postponed: Postponed | None = None

    @property
    def choices(self) -> Flags:
        """Decisions: the race goes on and more than one call is legal, bool [T, R]."""
        return self.running & (self.legal.sum(axis=2) > 1)

    def moment(self, lap: int, race: int = 0) -> Moment:
        """The decision before lap `lap`, 1 for the first, of the race in column `race`; only with `states`."""
        assert self.states is not None, "recorded without states"
        i = lap - 1
        f, k, r = (a[i, race].copy() for a in self.states)
        return Moment(
            self.record, self.car, lap, self.raw[:lap, race].copy(), self.legal[i, race].copy(), self.calls[:i, race].copy(), (f, k, r),
            self.seed, int(self.races[race]),
        )  # fmt: skip

    @cached_property
    def feature_range(self) -> tuple[Floats, Floats]:
        """Least and greatest value of every feature over all decisions, float32 [RAW_SIZE] each."""
        rows = self.raw[self.choices]
        return rows.min(axis=0), rows.max(axis=0)

    def covers(self, raw: Floats) -> bool:
        """Whether every continuous feature of a raw row lies within `feature_range`."""
        low, high = self.feature_range
        return bool(((raw >= low) & (raw <= high))[CONTINUOUS].all())


@dataclass(frozen=True)
class Episode:
    """One race that the policy called, up to its flag or retirement: T steps; arrays as in `Episodes`.

    Attributes:
        position: finishing position, 1 for the winner.
        retired: the car did not reach the flag.
    """

    whole: Episodes
    raw: Floats
    legal: Flags
    q: Floats
    calls: Calls
    position: int
    retired: bool

    @property
    def laps(self) -> int:
        """Decisions taken, T."""
        return len(self.calls)

    def moment(self, lap: int) -> Moment:
        """The decision before lap `lap`, 1 for the first."""
        return self.whole.moment(lap)


class EpisodeRecorder:
    """Records races of one car, a batch at a time.

    Args:
        batch: races side by side.
        policy: labels every state, its own or not; None for no labels.
        states: keep the simulator's states, which `Episodes.moment` needs.
        postpone: keep what `Postponed` describes; needs a policy.
    """

    def __init__(
        self,
        record: RaceRecord,
        car: int,
        batch: int,
        policy: ExplainedPolicy | None = None,
        *,
        states: bool = False,
        postpone: bool = False,
    ) -> None:
        self.environment = RaceEnvironment(record, car, batch=batch)
        self._policy, self._states = policy, states
        self._other = RaceEnvironment(record, car, batch=batch) if postpone else None

    def record(self, seed: int, first_race: int = 0, driver: Strategist | None = None, *, before_lap: int | None = None) -> Episodes:
        """Record races `first_race`, `first_race` + 1 ... of a seed.

        Args:
            driver: makes the calls; None for the policy, which is greedy.
            before_lap: record up to this lap and do not call it; None for the whole race.
        """
        environment, policy = self.environment, self._policy
        races = np.arange(first_race, first_race + environment.batch, dtype=np.int64)
        environment.reset(seed, races)
        if driver is not None:
            driver.begin(environment, seed, races)
        labeller = None if policy is None else _Labeller(policy, environment)
        shape = (before_lap or environment.laps, environment.batch)
        kept: dict[str, Any] = {"calls": np.zeros(shape, np.int8), "rewards": np.zeros(shape, np.float32)}
        if labeller is None:
            kept |= {"q": np.full((*shape, 4), np.nan, np.float32), "labels": np.full(shape, -1, np.int8)}
        later: dict[str, Any] = {}
        with threadpool_limits(1, "blas"):  # small matrices: threads only slow them down, and may change a last bit
            for step in range(len(kept["calls"])):
                if environment.done.all():
                    break
                _keep(kept, shape[0], step, self._seen(labeller))
                if step + 1 == before_lap:
                    break
                calls = kept["labels"][step] if driver is None else driver.decide(environment)
                kept["calls"][step] = calls
                if self._other is not None and labeller is not None:
                    _keep(later, shape[0], step, _without_stops(environment, self._other, labeller, calls))
                kept["rewards"][step] = environment.step(calls).reward
        states = tuple(kept.pop(name) for name in "fkr") if self._states else None
        return Episodes(
            environment.record, environment.car, seed, races, **kept, outcome=environment.outcome(), states=states,
            postponed=Postponed(**later) if later else None,
        )  # fmt: skip

    def _seen(self, labeller: "_Labeller | None") -> dict[str, Any]:
        environment = self.environment
        seen: dict[str, Any] = {"raw": environment.raw, "legal": environment.legal, "running": ~environment.done}
        if labeller is not None:
            seen["q"], seen["labels"] = labeller.label(environment)
        if self._states:
            seen |= zip("fkr", _arrays(environment), strict=True)
        return seen


class _Labeller:
    """The policy's answer to every state of a batch; its memory follows the races even if another strategist drives them."""

    def __init__(self, policy: ExplainedPolicy, environment: RaceEnvironment) -> None:
        self._policy = policy
        self._encode = policy.encoder(environment.record)
        self._memory = policy.agent.initial_memory(environment.batch)

    def label(self, environment: RaceEnvironment) -> tuple[Floats, Calls]:
        """Values [R, 4] and calls [R]; the memory moves on."""
        q, self._memory = self._policy.agent.q_values(self._encode(environment.raw), self._memory)
        return q, self._policy.chosen(q, environment.legal)

    def peek(self, environment: RaceEnvironment) -> Floats:
        """Values [R, 4]; the memory stays."""
        return self._policy.agent.q_values(self._encode(environment.raw), self._memory)[0]


def _without_stops(environment: RaceEnvironment, other: RaceEnvironment, labeller: _Labeller, calls: Calls) -> dict[str, Any]:
    """The races one lap later with everybody called staying out, as `Postponed` keeps them; the races themselves stay as they are."""
    for copy, array in zip(_arrays(other), _arrays(environment), strict=True):
        copy[...] = array
    other.done[...] = environment.done
    other.step(np.zeros_like(calls))
    return {"raw": other.raw, "legal": other.legal, "q": labeller.peek(other), "running": ~other.done & (calls > 0)}


def _arrays(environment: RaceEnvironment) -> Arrays:
    return environment.races.f, environment.races.k, environment.races.r


def _keep(kept: dict[str, Any], steps: int, step: int, values: Mapping[str, Any]) -> None:
    """Copy the arrays of one step to their place; steps that are never driven stay zero."""
    for name, value in values.items():
        if name not in kept:
            kept[name] = np.zeros((steps, *value.shape), value.dtype)
        kept[name][step] = value


def record_episode(policy: ExplainedPolicy, record: RaceRecord, car: int, *, seed: int = 0, race: int = 0) -> Episode:
    """Let the policy call race number `race` of a seed to the flag, or to the car's retirement."""
    whole = EpisodeRecorder(record, car, 1, policy, states=True).record(seed, race)
    own = np.s_[: int(whole.running.sum()), 0]
    return Episode(
        whole, whole.raw[own], whole.legal[own], whole.q[own], whole.calls[own],
        position=int(whole.outcome.position[0]), retired=bool(whole.outcome.retired[0]),
    )  # fmt: skip


def first_finished_race(strategist: Strategist, record: RaceRecord, car: int, *, seed: int = 0) -> int:
    """Number of the first race of a seed that the car finishes when the strategist calls it.

    Raises:
        RsrlError: it finishes none of the first `MOST_TRIED`.
    """
    recorder = EpisodeRecorder(record, car, 1)
    for race in range(MOST_TRIED):
        if not recorder.record(seed, race, strategist).outcome.retired[0]:
            return race
    raise RsrlError(f"{record.cars[car].driver} finishes none of the first {MOST_TRIED} races of seed {seed}; choose another --seed")


def reach(strategist: Strategist, record: RaceRecord, car: int, lap: int, *, seed: int = 0, race: int = 0) -> Moment:
    """Let a strategist call a simulated race up to the decision for lap `lap`.

    Raises:
        RsrlError: there is no such lap.
        RaceOverError: the car's race is over before it.
    """
    if not 1 <= lap <= record.laps:
        raise RsrlError(f"lap {lap} is outside the race: {record.name} has laps 1 to {record.laps}")
    episodes = EpisodeRecorder(record, car, 1, states=True).record(seed, race, strategist, before_lap=lap)
    if not episodes.running[-1, 0]:
        driver, over = record.cars[car].driver, int(episodes.running.sum())
        raise RaceOverError(f"the race of {driver} is over after lap {over}; choose a lap up to {over}, or another race")
    return episodes.moment(lap)
