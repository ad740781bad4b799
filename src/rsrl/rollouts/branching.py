"""Many races and cars to learn from, with branches: the same race run on once for each call. See branch_kernels.py."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.rollouts import branch_kernels
from rsrl.rollouts.compiled_network import CompiledPolicy, compiled_policy
from rsrl.season import RaceRecord, perturbed
from rsrl.simulator import Figures, compile_figures
from rsrl.simulator import layout as at
from rsrl.simulator.setup import assign_callers
from rsrl.state import RAW_SIZE, Encoder, Observer, RaceContext

CHUNK_RACES = 8
"""Races a thread drives at a time."""


@dataclass(frozen=True, kw_only=True)
class Branching:
    """How races are driven and where they branch.

    Attributes:
        decisions: most decisions of a race that are branched.
        most, least: chance that a decision is branched where two calls are level, and where one is far ahead.
        scale: how far ahead, in units of value, the chance falls by 1/e.
        all_calls: share of branched decisions for which every legal call is tried; else staying, the best stop and the second best call.
        plan_share: share of races that stop at random, about twice a race, up to a random lap.
        pit_chance: chance per lap to stop for a random tyre where the best call is to stay.
        delay_chance: chance to stay where the best call is to stop.
    """

    decisions: int
    most: float
    least: float
    scale: float
    all_calls: float
    plan_share: float
    pit_chance: float
    delay_chance: float

    def settings(self) -> NDArray[np.float32]:
        """As the kernel reads them."""
        values = np.zeros(branch_kernels.S_SIZE, np.float32)
        values[branch_kernels.S_PLAN_SHARE], values[branch_kernels.S_PIT_CHANCE] = self.plan_share, self.pit_chance
        values[branch_kernels.S_DELAY_CHANCE], values[branch_kernels.S_ALL_SHARE] = self.delay_chance, self.all_calls
        values[branch_kernels.S_BRANCH_MOST], values[branch_kernels.S_BRANCH_LEAST] = self.most, self.least
        values[branch_kernels.S_BRANCH_SCALE] = self.scale
        return values


class Branches(NamedTuple):
    """Decisions and what became of each call: N decisions.

    Attributes:
        features: network input, float32 [N, F].
        legal: bool [N, 4].
        positions: finishing position after each call, float32 [N, 4]; not a number where it was not tried.
    """

    features: NDArray[np.float32]
    legal: NDArray[np.bool_]
    positions: NDArray[np.float32]


class _Contest(NamedTuple):
    """One race and car, ready for the kernel."""

    figures: Figures
    table: NDArray[np.int32]
    callers: NDArray[np.int32]
    car: int
    known: RaceContext
    encoder: Encoder


class _Memory(NamedTuple):
    """A thread's working memory."""

    f: NDArray[np.float32]
    k: NDArray[np.int32]
    r: NDArray[np.int32]
    f2: NDArray[np.float32]
    k2: NDArray[np.int32]
    r2: NDArray[np.int32]
    actions: NDArray[np.int8]
    raw: NDArray[np.float32]
    x: NDArray[np.float32]
    x2: NDArray[np.float32]
    hidden: NDArray[np.float32]
    legal: NDArray[np.bool_]
    legal2: NDArray[np.bool_]
    q: NDArray[np.float32]
    q2: NDArray[np.float32]
    positions: NDArray[np.int8]


class BranchingRaces:
    """Races of some records and cars, each drawn anew within its uncertainty, that branch at decisions.

    Attributes:
        feature_set, feature_names, n_features: of the observations.
        expected_scale_s: seconds that the range of an expected-time feature stands for; 0 in a set without them.

    Args:
        entries: records and cars to draw from, all alike.
        uncertainty: scale of the perturbation of the figures; 0 keeps them as they are.
        contests: records and cars drawn at a time.
        threads: how many; never changes what comes out.
    """

    def __init__(
        self,
        entries: Sequence[tuple[RaceRecord, int]],
        *,
        feature_set: str = "full",
        uncertainty: float = 0.0,
        contests: int = 16,
        threads: int = 1,
    ) -> None:
        self._entries, self._uncertainty, self._contests, self._threads = tuple(entries), uncertainty, contests, threads
        encoder = Encoder(feature_set, entries[0][0].scaling)
        self.feature_set, self.feature_names, self.n_features = feature_set, encoder.names, encoder.width
        self.expected_scale_s = next((f.fixed[1] for f in encoder.features if f.name == "expected_stay_s" and f.fixed), 0.0)
        self._as_they_are = lru_cache(maxsize=1024)(lambda entry: _make_contest(*self._entries[entry], feature_set))

    def branch(self, params: Mapping[str, Any], branching: Branching, seed: int, iteration: int, races: int) -> Branches:
        """Drive `races` races of an iteration with the policy of these weights; the same bits for any number of threads."""
        policy = compiled_policy(params)
        rng = np.random.default_rng([seed, iteration])
        count = min(self._contests, len(self._entries) if self._uncertainty == 0.0 else self._contests)
        picked = rng.integers(len(self._entries), size=count)
        numbers = np.array_split(iteration * races + np.arange(races, dtype=np.int64), count)
        settings = branching.settings()

        def drawn(job: tuple[int, np.random.Generator]) -> _Contest:
            return self._drawn(*job)

        def run(job: tuple[_Contest, NDArray[np.int64]]) -> Branches:
            return _drive(job[0], policy, settings, branching.decisions, seed, job[1])

        with ThreadPoolExecutor(self._threads) as pool:
            contests = list(pool.map(drawn, zip((int(p) for p in picked), rng.spawn(count), strict=True)))
            jobs = [(c, part) for c, n in zip(contests, numbers, strict=True) for part in _chunks(n)]
            found = list(pool.map(run, jobs))
        return Branches(*(np.concatenate(column) for column in zip(*found, strict=True)))

    def _drawn(self, entry: int, rng: np.random.Generator) -> _Contest:
        if self._uncertainty == 0.0:
            return self._as_they_are(entry)
        record, car = self._entries[entry]
        return _make_contest(perturbed(record, rng, self._uncertainty), car, self.feature_set)


def _make_contest(record: RaceRecord, car: int, feature_set: str) -> _Contest:
    figures = compile_figures(record)
    table, callers = assign_callers(figures, {}, outside=(car,))
    return _Contest(figures, table, callers, car, Observer(record, car).known, Encoder(feature_set, record.scaling))


def _chunks(races: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    return [races[i : i + CHUNK_RACES] for i in range(0, len(races), CHUNK_RACES)]


def _memory(n_features: int, width: int) -> _Memory:
    def state() -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:
        f, k = np.empty((at.F_ROWS, at.CARS), np.float32), np.empty((at.K_ROWS, at.CARS), np.int32)
        return f, k, np.empty(at.R_SIZE, np.int32)

    return _Memory(
        *state(), *state(), np.zeros(at.CARS, np.int8), np.zeros(RAW_SIZE, np.float32), np.zeros(n_features, np.float32),
        np.zeros(n_features, np.float32), np.zeros((2, width), np.float32), np.zeros(4, np.bool_), np.zeros(4, np.bool_),
        np.zeros(4, np.float32), np.zeros(4, np.float32), np.zeros(at.CARS, np.int8),
    )  # fmt: skip


def _drive(
    contest: _Contest, policy: CompiledPolicy, settings: NDArray[np.float32], decisions: int, seed: int, races: NDArray[np.int64]
) -> Branches:
    n, width = len(races), contest.encoder.width
    features = np.empty((n, decisions, width), np.float32)
    legal = np.empty((n, decisions, 4), np.bool_)
    scores = np.empty((n, decisions, 4), np.float32)
    counts = np.empty(n, np.int32)
    branch_kernels.branch_races(
        contest.figures, contest.table, contest.callers, seed, seed + EXPLORATION, races, contest.car, contest.known, contest.encoder.rows,
        contest.encoder.values, policy, settings, _memory(width, policy.bias1.shape[0]), features, legal, scores, counts,
    )  # fmt: skip
    kept = np.arange(decisions) < counts[:, None]
    return Branches(features[kept], legal[kept], scores[kept])


EXPLORATION = 2**50
"""Sets the luck of experiments apart from that of the races."""


def greedy_positions(
    record: RaceRecord, car: int, params: Mapping[str, Any], feature_set: str, seed: int, races: NDArray[np.int64]
) -> NDArray[np.int8]:
    """Finishing positions int8 [n] of races called by a policy of these weights, without experiments."""
    contest, policy = _make_contest(record, car, feature_set), compiled_policy(params)
    out = np.zeros(len(races), np.int8)
    branch_kernels.greedy_races(
        contest.figures, contest.table, contest.callers, seed, races, car, contest.known, contest.encoder.rows, contest.encoder.values,
        policy, _memory(contest.encoder.width, policy.bias1.shape[0]), out,
    )  # fmt: skip
    return out
