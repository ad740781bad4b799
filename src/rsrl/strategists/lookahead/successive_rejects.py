"""Candidates on trial: fewer and fewer of them on more and more futures, the same for all that are left."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.strategists.lookahead.candidates import Candidates

PLACES_PER_S: Final = 0.08
"""What a second of clean-air time costs in places, about: where candidates are believed to stand before they have raced."""

PRIOR_SD: Final = 0.15
"""How far off that is, places."""

FUTURE_SD: Final = 0.9
"""How far one future is off the mean of many, places, between two candidates in the same futures."""

KEEP: Final = 0.6
"""Share of the candidates that go on from a round, ..."""

CLEAR: Final = 3.0
"""... those left out that are so many standard errors behind the best."""

FINALISTS: Final = 2

Race = Callable[[NDArray[np.int64], int], NDArray[np.float32]]
"""Called with the candidates that still race, int64 [m], and a number of futures: their places in the next so many, [futures, m]."""


def best_candidate(candidates: Candidates, race: Race, runs: int) -> int:
    """Index of the candidate of the best mean place, on at most `runs` runs of one candidate in one future.

    Means are shrunk to what clean air says, by `PRIOR_SD` and `FUTURE_SD`. The trial ends early where all that are left make the same call.
    """
    prior = PLACES_PER_S * candidates.cost_s
    weight = (FUTURE_SD / PRIOR_SD) ** 2  # the prior's, in futures
    alive = np.arange(len(prior))
    total, futures = np.zeros(len(prior)), 0
    rounds = rounds_of(len(prior))
    left = runs
    ranking = alive[np.argsort(prior, kind="stable")]
    for i in range(rounds):
        more = left // (len(alive) * (rounds - i))
        if more < 1:
            break
        total[alive] += race(alive, more).sum(axis=0)
        futures += more
        left -= more * len(alive)
        mean = (total[alive] + weight * (prior[alive] + _level(total[alive] / futures - prior[alive]))) / (futures + weight)
        order = np.argsort(mean, kind="stable")
        ranking = alive[order]
        behind = mean[order] - mean[order[0]]
        going = ranking[: max(round(len(alive) * KEEP), FINALISTS)]
        going = going[behind[: len(going)] <= CLEAR * FUTURE_SD / np.sqrt(futures + weight)]
        if (candidates.call[going] == candidates.call[ranking[0]]).all():
            break
        alive = np.sort(going)
    return int(ranking[0])


def rounds_of(candidates: int) -> int:
    """Rounds from so many candidates down to the finalists, and one for those."""
    rounds = 1
    while candidates > FINALISTS:
        candidates = max(round(candidates * KEEP), FINALISTS)
        rounds += 1
    return rounds


def _level(values: NDArray[np.float64]) -> float:
    return float(values.mean())
