"""Shapley values of a value function, exact from all coalitions or estimated from permutations, and pairwise interactions."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.attribution.values import Doubles, Game, ValueFunction, single_blas_thread

MAX_EXACT_PLAYERS: Final = 16
"""Players up to which all coalitions are evaluated, which makes the values exact by construction."""


@dataclass(frozen=True)
class ShapleyValues:
    """Shapley values of n players for the value of each of the four calls.

    Attributes:
        by_reference: values against each reference, float64 [K, n, 4]; `values` is their mean.
        empty, full: values of the empty and the full coalition, float64 [4].
        variances: covariance of the estimates over the four calls, float64 [K, n, 4, 4]; zero where exact.
        interactions: Shapley interaction indices, float64 [n, n, 4]; None unless all values are exact.
        exact: no value is estimated.
        evaluations: coalitions evaluated, over all references.
    """

    by_reference: Doubles
    empty: Doubles
    full: Doubles
    variances: Doubles
    interactions: Doubles | None
    exact: bool
    evaluations: int

    @property
    def values(self) -> Doubles:
        """Shapley values [n, 4], the mean over references."""
        return self.by_reference.mean(axis=0)

    def standard_errors(self, weights: Doubles) -> Doubles:
        """Standard errors [n] of `values @ weights`, from the sampled permutations."""
        return np.sqrt(np.einsum("a,kiab,b->i", weights, self.variances, weights)) / len(self.by_reference)

    def reference_errors(self, weights: Doubles) -> Doubles:
        """Standard errors [n] of `values @ weights` from the choice of K references; NaN for a single one."""
        k = len(self.by_reference)
        values = self.by_reference @ weights
        return values.std(axis=0, ddof=1) / math.sqrt(k) if k > 1 else np.full(values.shape[1], math.nan)


def shapley_values(
    v: ValueFunction, budget: int | None, rng: np.random.Generator, default_budget: int, *, force_sampling: bool = False
) -> ShapleyValues:
    """Shapley values of the players of `v`.

    Args:
        budget: coalitions to evaluate at most; None evaluates all where no reference's game has more than `MAX_EXACT_PLAYERS` players,
            else `default_budget`.
        force_sampling: estimate even where exact values are possible, to measure the error of estimates.

    Raises:
        RsrlError: the budget is too small for two antithetic pairs of permutations for each reference.
    """
    needed = [2 ** len(g.players) for g in v.games]
    whole = max(needed) <= 2**MAX_EXACT_PLAYERS if budget is None else sum(needed) <= budget
    each = (budget if budget is not None else default_budget) // len(v.games)
    by_reference, variances = np.zeros((len(v.games), v.count, 4)), np.zeros((len(v.games), v.count, 4, 4))
    ends, interactions, tried, exact = np.zeros((len(v.games), 2, 4)), np.zeros((v.count, v.count, 4)), 0, True
    with single_blas_thread():
        for k, game in enumerate(v.games):
            who = game.players
            if (whole or needed[k] <= min(each, 2**MAX_EXACT_PLAYERS)) and not (force_sampling and len(who) > 1):
                all_values = game.all_values()
                by_reference[k, who] = exact_values(all_values)
                interactions[np.ix_(who, who)] += interaction_indices(all_values) / len(v.games)
                ends[k], count = all_values[[0, -1]], len(all_values)
            else:
                by_reference[k, who], variances[k, who], ends[k], count = _sampled(game, each, rng)
                exact = False
            tried += count
    empty, full = ends.mean(axis=0)
    return ShapleyValues(by_reference, empty, full, variances, interactions if exact else None, exact, tried)


def exact_values(values: Doubles) -> Doubles:
    """Shapley values [n, A] from the values [2^n, A] of all coalitions (Shapley, 1953); bit j of an index is player j."""
    n = len(values).bit_length() - 1
    others = _sizes(n - 1) if n else np.zeros(0, np.int64)
    weights = np.array([1.0 / (n * math.comb(n - 1, s)) for s in range(n)])[others]
    result = np.zeros((n, values.shape[1]))
    for j in range(n):
        split = values.reshape(-1, 2, 2**j, values.shape[1])
        result[j] = weights @ (split[:, 1] - split[:, 0]).reshape(-1, values.shape[1])
    return result


def interaction_indices(values: Doubles) -> Doubles:
    """Shapley interaction index of each pair [n, n, A] (Grabisch and Roubens, 1999), from the values [2^n, A] of all coalitions.

    How much more two players contribute together than each alone, averaged over coalitions of the others; zero on the diagonal.
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
    """Number of players in each of the 2^n coalitions."""
    return np.bitwise_count(np.arange(2**n)).astype(np.int64)


def _sampled(game: Game, budget: int, rng: np.random.Generator) -> tuple[Doubles, Doubles, Doubles, int]:
    """Estimates [n, 4], their variances [n, 4, 4], values of the empty and full coalition [2, 4], and the coalitions evaluated.

    Permutations come in antithetic pairs, each with its reverse (Mitchell et al., 2022): the reverse visits the complements, and the two
    errors tend to cancel. Every pair adds up to v(all) - v(), and so does the estimate.
    """
    n = len(game.players)
    pairs = (budget - 2) // (2 * (n - 1))
    if pairs < 2:
        raise RsrlError(
            f"attribution: a budget of {budget} for each reference is too small for {n} players; give {4 * (n - 1) + 2} or more"
        )
    order = np.argsort(rng.random((pairs, n)), axis=1)
    place = np.argsort(order, axis=1)
    prefixes = place[:, None, :] < np.arange(1, n)[:, None]  # [pairs, n - 1, n]: the first 1, 2 ... players of a permutation
    values = game.values(np.concatenate([prefixes, ~prefixes]).reshape(-1, n)).reshape(2, pairs, n - 1, 4)
    ends = game.values(np.array([[False] * n, [True] * n]))
    empty, full = (np.broadcast_to(end, (pairs, 1, 4)) for end in ends)
    forward = np.diff(np.concatenate([empty, values[0], full], axis=1), axis=1)
    backward = -np.diff(np.concatenate([full, values[1], empty], axis=1), axis=1)
    estimates = np.take_along_axis((forward + backward) / 2, place[:, :, None], axis=1)
    centred = estimates - estimates.mean(axis=0)
    variances = np.einsum("mia,mib->iab", centred, centred) / (pairs * (pairs - 1))
    return estimates.mean(axis=0), variances, ends, 2 * pairs * (n - 1) + 2
