"""Every sequence of calls of a short race without traffic, driven one by one: a slow reference for dynamic programmes."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np


def least_time_s(
    cost_s: Callable[[int, int], float],
    cold_s: Sequence[float],
    stop_s: float,
    sets: Sequence[int],
    start: int,
    laps: int,
    allowed: Callable[[list[int]], bool],
) -> float:
    """Least tyre and stop time of a race of `laps` from a start on compound `start`, s; infinite where nothing is allowed.

    Args:
        cost_s: of a lap, by compound and age.
        cold_s: of the first lap on a new set, by compound.
        stop_s: of a stop.
        sets: of each compound at the start.
        allowed: whether the rules allow a race with so many sets left of each compound.
    """
    best = np.inf
    for calls in itertools.product(range(4), repeat=laps - 1):
        fitted, age, total, left = start, 0, 0.0, [n - (c == start) for c, n in enumerate(sets)]
        for call in (*calls, 0):
            total += cost_s(fitted, age)
            age += 1
            if call:
                left[call - 1] -= 1
                fitted, age = call - 1, 0
                total += stop_s + cold_s[fitted]
        if min(left) >= 0 and allowed(left):
            best = min(best, total)
    return best
