"""Training data: many races and cars, branched at decisions, each branch rolled out once for each call. See branch_kernels.py."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.rollouts.branch_kernels import BranchMemory, BranchRows, Exploration, RaceEntry, branch_races, greedy_races
from rsrl.rollouts.compiled_network import CompiledNetwork, compiled_network
from rsrl.rollouts.compiled_policy import CompiledPolicy, PolicyInputs, decision_memory, policy_inputs
from rsrl.season import RaceRecord, perturbed
from rsrl.simulator import compile_figures
from rsrl.simulator import layout as at
from rsrl.simulator.race_arrays import empty_race
from rsrl.simulator.setup import assign_callers
from rsrl.state import Encoder, Observer

CHUNK_RACES = 8
"""Races a thread drives at a time."""


@dataclass(frozen=True, kw_only=True)
class Branching:
    """How races are driven and where they branch.

    Attributes:
        decisions: most decisions of a race that are branched.
        most, least: chance that a decision is branched where the two best calls are level, and where the best is far ahead.
        scale: lead of the best call, in units of value, over which the chance falls by a factor of e.
        all_calls: share of branched decisions in which all legal calls are rolled out; else staying, the best stop and the second best.
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

    def exploration(self) -> Exploration:
        """As the kernels read it."""
        values = (self.plan_share, self.pit_chance, self.delay_chance, self.most, self.least, self.scale, self.all_calls)
        return Exploration(*(np.float32(value) for value in values))


class Branches(NamedTuple):
    """N decisions and the result of each call.

    Attributes:
        features: network input, float32 [N, F].
        legal: bool [N, 4].
        positions: finishing position after each call, float32 [N, 4]; NaN where it was not rolled out.
        extra_stops: stops made from the decision on that the tyre rules no longer asked for, float32 [N, 4]; NaN likewise.
    """

    features: NDArray[np.float32]
    legal: NDArray[np.bool_]
    positions: NDArray[np.float32]
    extra_stops: NDArray[np.float32]


class _Contest(NamedTuple):
    """One race and car, and how a policy sees it."""

    entry: RaceEntry
    inputs: PolicyInputs


class BranchingRaces:
    """Races of some records and cars that branch at decisions; the figures of each are drawn within their uncertainty.

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
        network = compiled_network(params)
        rng = np.random.default_rng([seed, iteration])
        count = min(self._contests, len(self._entries) if self._uncertainty == 0.0 else self._contests)
        picked = rng.integers(len(self._entries), size=count)
        numbers = np.array_split(iteration * races + np.arange(races, dtype=np.int64), count)
        settings = branching.exploration()

        def drawn(job: tuple[int, np.random.Generator]) -> _Contest:
            return self._drawn(*job)

        def run(job: tuple[_Contest, NDArray[np.int64]]) -> Branches:
            return _drive(job[0], network, settings, branching.decisions, seed, job[1])

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
    inputs = policy_inputs(Observer(record, car).context, Encoder(feature_set, record.scaling))
    return _Contest(RaceEntry(figures, table, callers, car), inputs)


def _chunks(races: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    return [races[i : i + CHUNK_RACES] for i in range(0, len(races), CHUNK_RACES)]


def _memory(policy: CompiledPolicy) -> BranchMemory:
    return BranchMemory(
        empty_race(), empty_race(), decision_memory(policy), decision_memory(policy), np.zeros(at.CARS, np.int8),
        np.zeros(at.CARS, np.int8),
    )  # fmt: skip


def _drive(
    contest: _Contest, network: CompiledNetwork, settings: Exploration, decisions: int, seed: int, races: NDArray[np.int64]
) -> Branches:
    n, policy = len(races), CompiledPolicy(contest.inputs, network)
    rows = BranchRows(
        np.empty((n, decisions, contest.inputs.width), np.float32), np.empty((n, decisions, 4), np.bool_),
        np.empty((n, decisions, 4), np.float32), np.empty((n, decisions, 4), np.float32), np.empty(n, np.int32),
    )  # fmt: skip
    branch_races(contest.entry, policy, seed, seed + EXPLORATION, races, settings, _memory(policy), rows)
    kept = np.arange(decisions) < rows.counts[:, None]
    return Branches(rows.features[kept], rows.legal[kept], rows.positions[kept], rows.extra_stops[kept])


EXPLORATION = 2**50
"""Sets the draws of the exploration apart from those of the races."""


def greedy_positions(
    record: RaceRecord, car: int, params: Mapping[str, Any], feature_set: str, seed: int, races: NDArray[np.int64]
) -> NDArray[np.int8]:
    """Finishing positions int8 [n] of races called by a policy of these weights, without exploration."""
    contest = _make_contest(record, car, feature_set)
    policy = CompiledPolicy(contest.inputs, compiled_network(params))
    out = np.zeros(len(races), np.int8)
    greedy_races(contest.entry, policy, seed, races, _memory(policy), out)
    return out
