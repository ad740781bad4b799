"""Plans of one car ranked in the simulated race: the best of every sequence of compounds, and what its real plan gives away."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from rsrl.calibration.choices import SEQUENCE_INDEX
from rsrl.season import RaceRecord
from rsrl.simulator import Figures, Plan, simulate_plans
from rsrl.strategists import CleanAir

CLOSE_S: Final = 12.0
"""Sequences that lose more than this to the best on an empty track are not simulated, beyond the `FEWEST`."""

FEWEST: Final = 6
EARLIER_LAPS: Final = (0, 2, 4)
"""Stops are tried as an empty track has them and so many laps earlier: in a race the undercut pays."""

RETIRED_S: Final = 100_000.0
"""No race takes so long: the simulator gives cars that retired a time beyond it (`simulator.lap.OUT`)."""

SCREEN_SHARE: Final = 4  # the first screening takes a quarter of the races


class Ranking(NamedTuple):
    """Plans of one car in the race.

    Attributes:
        best: plan of the best mean finishing position; equal means are told apart by race time.
        own_sequence_first_stop: lap of the first stop of the best plan of the sequence that the car ran; NaN where the forecast gives it
            too few sets for it.
        regret_places: mean position of the plan that the car ran, less the best plan's, on races that the best was not chosen on.
        regret_s: the same in race time.
    """

    best: Plan
    own_sequence_first_stop: float
    regret_places: float
    regret_s: float


class RankedSequence(NamedTuple):
    """A sequence on its best stop laps: mean finishing position and race time in s, on races that its stop laps were not chosen on."""

    plan: Plan
    place: float
    time_s: float


class CarPlans:
    """Plans of one car before the race, by sequence, each with its stop laps on an empty track."""

    def __init__(self, record: RaceRecord, car: int) -> None:
        self.record = record
        clean_air = CleanAir(record, car)
        self.by_sequence: dict[tuple[int, ...], tuple[float, tuple[int, ...]]] = {}
        for family in clean_air.families((0, 1, 2)):
            if family.compounds in SEQUENCE_INDEX:
                at = int(family.time_s.argmin())
                self.by_sequence[family.compounds] = (float(family.time_s[at]), tuple(int(x) for x in family.laps[at]))

    def candidates(self, real: tuple[int, ...]) -> list[Plan]:
        """Plans to simulate: sequences close to the best and the one that was run, each with a few choices of stop laps."""
        order = sorted(self.by_sequence, key=lambda c: self.by_sequence[c][0])
        best_s = self.by_sequence[order[0]][0]
        kept = [c for i, c in enumerate(order) if i < FEWEST or self.by_sequence[c][0] < best_s + CLOSE_S or c == real]
        plans: dict[Plan, None] = {}
        for compounds in kept:
            for earlier in EARLIER_LAPS:
                laps = _earlier(self.by_sequence[compounds][1], earlier, self.record)
                if laps is not None:
                    plans[Plan(compounds, laps)] = None
        return list(plans)


def _earlier(laps: tuple[int, ...], by: int, record: RaceRecord) -> tuple[int, ...] | None:
    """Stops `by` laps earlier, None where that is no plan."""
    moved = tuple(lap - by for lap in laps)
    limit = record.max_laps_per_set
    edges = (0, *moved, record.laps)
    lengths = np.diff(edges)
    return moved if (lengths > 0).all() and not (limit and (lengths > limit).any()) else None


def rank_plans(record: RaceRecord, figures: Figures, car: int, plans: CarPlans, real: Plan, seed: int, races: int) -> Ranking:
    """Rank the plans of a car.

    Args:
        record, figures: the race as it is forecast.
        car: index in the record.
        plans: of the car; the same for cars whose tyres and stops cost the same.
        real: the plan that the car ran.
        seed: of the simulated races, the same for every plan.
        races: simulated for each plan to choose the best, and as many again for its regret; a quarter as many choose the stop laps of each
            sequence.
    """
    ranked = rank_sequences(figures, car, plans.candidates(real.compounds), seed, races)
    best = ranked[0].plan
    own = [r.plan.laps[0] for r in ranked if r.plan.compounds == real.compounds]
    place, time_s = fresh_means(figures, car, [best, real], seed, races)
    return Ranking(best, float(own[0]) if own else float("nan"), float(place[1] - place[0]), float(time_s[1] - time_s[0]))


def rank_sequences(figures: Figures, car: int, candidates: Sequence[Plan], seed: int, races: int) -> list[RankedSequence]:
    """The best of the plans of every sequence, by mean position, equal ones by race time; arguments as of `rank_plans`."""
    first, second = np.arange(max(races // SCREEN_SHARE, 1)), np.arange(races, 2 * races)
    finalists = _best_of_each(candidates, *plan_means(figures, car, candidates, seed, first))
    place, time_s = plan_means(figures, car, finalists, seed, second)
    found = [RankedSequence(*one) for one in zip(finalists, place.tolist(), time_s.tolist(), strict=True)]
    return sorted(found, key=lambda r: (r.place, r.time_s))


def fresh_means(figures: Figures, car: int, plans: Sequence[Plan], seed: int, races: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean position and race time in s of plans, [plans], on races that `rank_sequences` chose nothing on.

    The least of many means is too low: on the races it was chosen on a best plan looks better, and regret larger, than it is.
    """
    return plan_means(figures, car, plans, seed, np.arange(2 * races, 3 * races))


def plan_means(figures: Figures, car: int, plans: Sequence[Plan], seed: int, races: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean position and race time of every plan; race time over the races that no plan retires from, which are the same for all."""
    places, times = simulate_plans(figures, car, plans, seed, races)
    finished = (times < RETIRED_S).all(axis=0)
    kept = times[:, finished] if finished.any() else times
    return places.mean(axis=1), kept.mean(axis=1)


def _best_of_each(plans: Sequence[Plan], place: np.ndarray, time_s: np.ndarray) -> list[Plan]:
    """The best plan of every sequence."""
    found: dict[tuple[int, ...], int] = {}
    for i, plan in enumerate(plans):
        j = found.get(plan.compounds)
        if j is None or (place[i], time_s[i]) < (place[j], time_s[j]):
            found[plan.compounds] = i
    return [plans[i] for i in found.values()]
