"""Shapley values of a value function: exact from all coalitions, or estimated from permutations; and pairwise interactions."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.attribution.values import Doubles, Game, ValueFunction, single_blas_thread

MOST_EXACT: Final = 16
"""Players up to which all coalitions are tried."""


@dataclass(frozen=True)
class Shapley:
    """How a value is shared out among n players, for each of the four calls.

    Attributes:
        by_reference: float64 [K, n, 4], the shares against each reference; the values are their mean.
        start, end: float64 [4], values with nobody and with everybody present.
        variances: float64 [K, n, 4, 4], of the estimates: covariance over the four calls; zero where exact.
        interactions: float64 [n, n, 4], Shapley interaction indices; None unless all is exact.
        exact: nothing is estimated.
        evaluations: coalitions tried, over all references.
    """

    by_reference: Doubles
    start: Doubles
    end: Doubles
    variances: Doubles
    interactions: Doubles | None
    exact: bool
    evaluations: int

    @property
    def values(self) -> Doubles:
        """Shares [n, 4]."""
        return self.by_reference.mean(axis=0)

    def standard_errors(self, weights: Doubles) -> Doubles:
        """Of the shares of `weights` [4] times the calls' values, from sampling permutations: [n]."""
        return np.sqrt(np.einsum("a,kiab,b->i", weights, self.variances, weights)) / len(self.by_reference)

    def reference_errors(self, weights: Doubles) -> Doubles:
        """The same from there being K references and no more: [n], not a number for a single one."""
        k = len(self.by_reference)
        shares = self.by_reference @ weights
        return shares.std(axis=0, ddof=1) / math.sqrt(k) if k > 1 else np.full(shares.shape[1], math.nan)


def shapley(
    v: ValueFunction, budget: int | None, rng: np.random.Generator, default_budget: int, *, force_sampling: bool = False
) -> Shapley:
    """Share out `v`.

    Args:
        budget: coalitions to try at most; None tries all where no reference's game has more than `MOST_EXACT` players, else
            `default_budget`.
        force_sampling: estimate even what could be computed, to see how good the estimates are.

    Raises:
        RsrlError: the budget is too small for two permutations, there and back, for each reference.
    """
    needed = [2 ** len(g.players) for g in v.games]
    whole = max(needed) <= 2**MOST_EXACT if budget is None else sum(needed) <= budget
    each = (budget if budget is not None else default_budget) // len(v.games)
    by_reference, variances = np.zeros((len(v.games), v.count, 4)), np.zeros((len(v.games), v.count, 4, 4))
    ends, interactions, tried, exact = np.zeros((len(v.games), 2, 4)), np.zeros((v.count, v.count, 4)), 0, True
    with single_blas_thread():
        for k, game in enumerate(v.games):
            who = game.players
            if (whole or needed[k] <= min(each, 2**MOST_EXACT)) and not (force_sampling and len(who) > 1):
                all_values = game.all_values()
                by_reference[k, who] = exact_shares(all_values)
                interactions[np.ix_(who, who)] += interaction_indices(all_values) / len(v.games)
                ends[k], count = all_values[[0, -1]], len(all_values)
            else:
                by_reference[k, who], variances[k, who], ends[k], count = _sampled(game, each, rng)
                exact = False
            tried += count
    start, end = ends.mean(axis=0)
    return Shapley(by_reference, start, end, variances, interactions if exact else None, exact, tried)


def exact_shares(values: Doubles) -> Doubles:
    """Shapley values [n, A] from the values [2^n, A] of all coalitions (Shapley, 1953); bit j of an index is player j."""
    n = len(values).bit_length() - 1
    others = _sizes(n - 1) if n else np.zeros(0, np.int64)
    weights = np.array([1.0 / (n * math.comb(n - 1, s)) for s in range(n)])[others]
    shares = np.zeros((n, values.shape[1]))
    for j in range(n):
        split = values.reshape(-1, 2, 2**j, values.shape[1])
        shares[j] = weights @ (split[:, 1] - split[:, 0]).reshape(-1, values.shape[1])
    return shares


def interaction_indices(values: Doubles) -> Doubles:
    """Shapley interaction index of each pair [n, n, A] (Grabisch and Roubens, 1999), from the values [2^n, A] of all coalitions.

    How much more two players bring together than each alone, averaged over what the others do; zero on the diagonal.
    """
    n, calls = len(values).bit_length() - 1, values.shape[1]
    indices = np.zeros((n, n, calls))
    if n < 2:
        return indices
    weights = np.array([1.0 / ((n - 1) * math.comb(n - 2, s)) for s in range(n - 1)])[_sizes(n - 2)]
    for j in range(n):
        split = values.reshape(-1, 2, 2**j, calls)
        gain = (split[:, 1] - split[:, 0]).reshape(-1, calls)  # of j, by the coalition of the others: bits above j move down by one
        for i in range(j):
            pair = gain.reshape(-1, 2, 2**i, calls)
            indices[i, j] = indices[j, i] = weights @ (pair[:, 1] - pair[:, 0]).reshape(-1, calls)
    return indices


def _sizes(n: int) -> NDArray[np.int64]:
    """Players in each of the 2^n coalitions."""
    return np.bitwise_count(np.arange(2**n)).astype(np.int64)


def _sampled(game: Game, budget: int, rng: np.random.Generator) -> tuple[Doubles, Doubles, Doubles, int]:
    """Shares [n, 4], their variances [n, 4, 4], the values at both ends [2, 4], and how many coalitions that took.

    Each permutation is walked there and back (Mitchell et al., 2022): the way back visits the complements, and the two errors
    tend to cancel. Every pair sums to the whole, so the estimate does too.
    """
    n = len(game.players)
    pairs = (budget - 2) // (2 * (n - 1))
    if pairs < 2:
        raise RsrlError(
            f"attribution: a budget of {budget} for each reference is too small for {n} players; give {4 * (n - 1) + 2} or more"
        )
    order = np.argsort(rng.random((pairs, n)), axis=1)
    place = np.argsort(order, axis=1)
    there = place[:, None, :] < np.arange(1, n)[:, None]  # [pairs, n - 1, n]: the first 1, 2 ... players of a permutation
    values = game.values(np.concatenate([there, ~there]).reshape(-1, n)).reshape(2, pairs, n - 1, 4)
    ends = game.values(np.array([[False] * n, [True] * n]))
    nobody, everybody = (np.broadcast_to(end, (pairs, 1, 4)) for end in ends)
    forth = np.diff(np.concatenate([nobody, values[0], everybody], axis=1), axis=1)
    back = -np.diff(np.concatenate([everybody, values[1], nobody], axis=1), axis=1)
    shares = np.take_along_axis((forth + back) / 2, place[:, :, None], axis=1)
    centred = shares - shares.mean(axis=0)
    variances = np.einsum("mia,mib->iab", centred, centred) / (pairs * (pairs - 1))
    return shares.mean(axis=0), variances, ends, 2 * pairs * (n - 1) + 2
