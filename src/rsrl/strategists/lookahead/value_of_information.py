"""How long to think about a call: futures are run while they are still worth running, and only of calls that may still turn out best.

Between two calls the network's difference and the mean difference of futures are both taken as normal about the truth, each with its own
spread, so what is thought after n futures is their precision-weighted mean, and what n more would change it by is known beforehand. The
value of that change, how much better a call it is expected to lead to, decides (the value of information of a normal mean: Raiffa &
Schlaifer, Applied Statistical Decision Theory, 1961, ch. 5).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

SPREAD_FUTURES: Final = 32
"""Futures that `Doubt.future_sd` counts for when the spread of a difference is told from the futures run."""

Run = Callable[[NDArray[np.int64], int, int], NDArray[np.float32]]
"""Called with (calls, first future, futures); finishing places float32 [futures, calls], all calls in the same futures."""


@dataclass(frozen=True)
class Doubt:
    """How far off the sources are, in places between two calls.

    Attributes:
        network_sd: the network's difference is off the truth.
        future_sd: the difference in one future is off the mean of all; a first guess, which futures run correct.
    """

    network_sd: float
    future_sd: float


def value_of_thinking(behind: float, change_sd: float) -> float:
    """Places to be won by looking into a call thought `behind` places worse than the best, where that changes by N(0, change_sd)."""
    if change_sd <= 0.0:
        return 0.0
    z = behind / change_sd
    return change_sd * (math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi) - 0.5 * z * math.erfc(z / math.sqrt(2.0)))


def deliberate(
    q: NDArray[np.float32], legal: NDArray[np.bool_], run: Run, doubt: Doubt, *, worth: float, step: int, most: int
) -> tuple[int, int]:
    """The best call by network and futures together, and how many futures it took.

    Args:
        q: the network's values float32 [4], minus places.
        legal: bool [4].
        worth: a call is looked into no further once that is expected to win fewer places.
        step, most: futures at a time, and of a decision.
    """
    calls = np.flatnonzero(legal)
    calls = calls[np.argsort(-q[calls], kind="stable")]
    places, done = np.zeros((0, len(calls)), np.float64), 0
    while True:
        best, alive = _worth_running(q[calls].astype(np.float64), places, doubt, worth, most)
        if len(alive) == 1 or done >= most:
            return int(calls[best]), done
        calls = calls[alive]
        more = min(step, most - done)
        places = np.concatenate([places[:, alive], run(calls, done, more).astype(np.float64)])
        done += more


def _worth_running(
    q: NDArray[np.float64], places: NDArray[np.float64], doubt: Doubt, worth: float, most: int
) -> tuple[int, NDArray[np.int64]]:
    """Which call is thought best, and those to run on with, itself included; `places` [futures, calls]."""
    futures = len(places)
    best = int(np.argmin(_behind(q, places, doubt, 0)[0]))
    behind, variance = _behind(q, places, doubt, best)
    weight = variance / doubt.network_sd**2
    change = np.sqrt(np.maximum(variance / (futures + weight) - variance / (most + weight), 0.0))
    alive = [i for i in range(len(q)) if i == best or value_of_thinking(max(float(behind[i]), 0.0), float(change[i])) >= worth]
    return best, np.array(alive)


def _behind(
    q: NDArray[np.float64], places: NDArray[np.float64], doubt: Doubt, than: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places by which every call is thought to be behind call `than`, and the variance of the difference in one future."""
    futures, difference = len(places), places - places[:, [than]]
    guessed = SPREAD_FUTURES * doubt.future_sd**2
    spread = ((difference - difference.mean(axis=0)) ** 2).sum(axis=0) if futures else np.zeros(len(q))
    variance = (guessed + spread) / (SPREAD_FUTURES + futures)
    weight = variance / doubt.network_sd**2  # the network's, in futures
    return (difference.sum(axis=0) + weight * (q[than] - q)) / (futures + weight), variance
