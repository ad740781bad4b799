"""Successive rejects: rounds of simulation in which the worst candidates drop out, so that the best of them get the most futures.

After Audibert, Bubeck & Munos (2010), "Best arm identification in multi-armed bandits", with a prior: the mean of a candidate is shrunk
towards its clean-air time. All remaining candidates meet the same futures (common random numbers).
"""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.strategists.lookahead.candidates import Candidates

PLACES_PER_S: Final = 0.08
"""Prior mean: places that a second of clean-air time costs."""

PRIOR_SD: Final = 0.15
"""Standard deviation of the prior, places."""

FUTURE_SD: Final = 0.9
"""Standard deviation of the difference between two candidates in one future, places."""

KEEP_SHARE: Final = 0.6
"""Share of the candidates that survives a round ..."""

MAX_STANDARD_ERRORS: Final = 3.0
"""... without those that are further behind the best."""

FINALISTS: Final = 2

Simulate = Callable[[NDArray[np.int64], int], NDArray[np.float32]]
"""Called with the remaining candidates, int64 [m], and a number of futures; returns positions in the next futures, [futures, m]."""


def best_candidate(candidates: Candidates, simulate: Simulate, max_rollouts: int) -> int:
    """Index of the candidate of the best posterior mean position; one rollout is one candidate in one future.

    Ends early once all remaining candidates make the same call. Where `max_rollouts` allows no future at all, the prior decides.
    """
    prior = PLACES_PER_S * candidates.cost_s
    weight = (FUTURE_SD / PRIOR_SD) ** 2  # of the prior, in futures
    alive = np.arange(len(prior))
    total, futures = np.zeros(len(prior)), 0
    rounds = round_count(len(prior))
    left = max_rollouts
    ranking = alive[np.argsort(prior, kind="stable")]
    for i in range(rounds):
        more = left // (len(alive) * (rounds - i))
        if more < 1:
            break
        total[alive] += simulate(alive, more).sum(axis=0)
        futures += more
        left -= more * len(alive)
        # The prior knows differences only: its level is that of the mean over the candidates.
        level = float((total[alive] / futures - prior[alive]).mean())
        mean = (total[alive] + weight * (prior[alive] + level)) / (futures + weight)
        order = np.argsort(mean, kind="stable")
        ranking = alive[order]
        behind = mean[order] - mean[order[0]]
        kept = ranking[: max(round(len(alive) * KEEP_SHARE), FINALISTS)]
        kept = kept[behind[: len(kept)] <= MAX_STANDARD_ERRORS * FUTURE_SD / np.sqrt(futures + weight)]
        if (candidates.call[kept] == candidates.call[ranking[0]]).all():
            break
        alive = np.sort(kept)
    return int(ranking[0])


def round_count(candidates: int) -> int:
    """Rounds from this many candidates down to the finalists, and one for the finalists."""
    rounds = 1
    while candidates > FINALISTS:
        candidates = max(round(candidates * KEEP_SHARE), FINALISTS)
        rounds += 1
    return rounds
