"""How many futures to simulate before a call: sampling goes on while the value of information exceeds its price.

The difference between two calls is estimated twice: by the network, and by the mean difference over simulated futures. Both errors are
taken as normal, so the posterior mean after n futures is the precision-weighted mean of the two, and the distribution of the change that
further futures would bring to it is known in advance. The expected gain from that change is the value of information of a normal mean
(Raiffa & Schlaifer, Applied Statistical Decision Theory, 1961, ch. 5); a call is sampled further only while it exceeds a threshold.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

PRIOR_FUTURES: Final = 32
"""Weight of `ErrorModel.future_sd`, in futures, where the spread of a difference is estimated from the futures simulated so far."""

Simulate = Callable[[NDArray[np.int64], int, int], NDArray[np.float32]]
"""Called with (calls, first future, futures); returns finishing positions float32 [futures, calls], all calls in the same futures."""


@dataclass(frozen=True)
class ErrorModel:
    """Standard deviations of the two estimates of the difference between two calls, in places.

    Attributes:
        network_sd: of the error of the network's difference.
        future_sd: of the difference in a single future about its mean; a prior, updated from the futures simulated.
    """

    network_sd: float
    future_sd: float


def value_of_sampling(deficit: float, change_sd: float) -> float:
    """Expected gain in places from sampling a call that is `deficit` places behind the best, if its estimate moves by N(0, change_sd)."""
    if change_sd <= 0.0:
        return 0.0
    z = deficit / change_sd
    return change_sd * (math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi) - 0.5 * z * math.erfc(z / math.sqrt(2.0)))


def choose_call(
    q: NDArray[np.float32],
    legal: NDArray[np.bool_],
    simulate: Simulate,
    errors: ErrorModel,
    *,
    min_value: float,
    batch: int,
    max_futures: int,
) -> tuple[int, int]:
    """The call of the best posterior mean, and the number of futures simulated to find it.

    Args:
        q: the network's action values float32 [4], minus expected finishing positions.
        legal: bool [4].
        min_value: places; a call whose value of sampling is lower is not simulated further.
        batch: futures simulated between two decisions to stop.
        max_futures: limit of the futures of one call.
    """
    calls = np.flatnonzero(legal)
    calls = calls[np.argsort(-q[calls], kind="stable")]
    positions, done = np.zeros((0, len(calls)), np.float64), 0
    while True:
        best, contenders = _contenders(q[calls].astype(np.float64), positions, errors, min_value, max_futures)
        if len(contenders) == 1 or done >= max_futures:
            return int(calls[best]), done
        calls = calls[contenders]
        more = min(batch, max_futures - done)
        positions = np.concatenate([positions[:, contenders], simulate(calls, done, more).astype(np.float64)])
        done += more


def _contenders(
    q: NDArray[np.float64], positions: NDArray[np.float64], errors: ErrorModel, min_value: float, max_futures: int
) -> tuple[int, NDArray[np.int64]]:
    """Index of the best call so far, and of the calls worth simulating further, the best included; `positions` [futures, calls]."""
    futures = len(positions)
    best = int(np.argmin(_deficits(q, positions, errors, 0)[0]))
    deficits, variance = _deficits(q, positions, errors, best)
    weight = variance / errors.network_sd**2
    change = np.sqrt(np.maximum(variance / (futures + weight) - variance / (max_futures + weight), 0.0))
    kept = [i for i in range(len(q)) if i == best or value_of_sampling(max(float(deficits[i]), 0.0), float(change[i])) >= min_value]
    return best, np.array(kept)


def _deficits(
    q: NDArray[np.float64], positions: NDArray[np.float64], errors: ErrorModel, reference: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Posterior mean deficit of every call to call `reference`, in places, and the variance of the difference in one future."""
    futures, difference = len(positions), positions - positions[:, [reference]]
    prior = PRIOR_FUTURES * errors.future_sd**2
    spread = ((difference - difference.mean(axis=0)) ** 2).sum(axis=0) if futures else np.zeros(len(q))
    variance = (prior + spread) / (PRIOR_FUTURES + futures)
    weight = variance / errors.network_sd**2  # of the network's estimate, in futures
    return (difference.sum(axis=0) + weight * (q[reference] - q)) / (futures + weight), variance
