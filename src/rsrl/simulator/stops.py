"""Pit stops, compiled: what they cost, who waits behind the team's other car, and the new tyres."""

import numpy as np

from rsrl.compiled import kernel
from rsrl.season import RED
from rsrl.simulator import random as rng
from rsrl.simulator.calls import load_next_stop
from rsrl.simulator.layout import (
    C_STOP,
    C_TAIL,
    F_COLD,
    F_DUE,
    F_LAP,
    F_RAW,
    F_TIME,
    K_BOX,
    K_ORDER,
    K_PLACE,
    K_PLAN,
    K_POINTER,
    K_STOPPED,
    K_STOPS,
    K_WANT,
    R_RUNNING,
    R_STATUS,
    R_WATCHED,
    T_IN_SHARE,
    T_PIT,
    T_STACK,
    Y_COLD,
)
from rsrl.simulator.pace_watch import change_set
from rsrl.simulator.tyres import fit_tyre

ZERO = np.float32(0.0)


@kernel(inline="always")
def stop_excess(fig, car, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Stop time of a car beyond the quickest, s."""
    return rng.from_table(rng.draw(key0, key1, lap, car, rng.STOP), fig.tail) * fig.cars[C_TAIL, car]


@kernel(inline="always")
def list_stops(k, n):  # type: ignore[no-untyped-def]
    """K_BOX: the running cars that box at the end of this lap; returns how many. Without branches, as nobody can predict them."""
    boxing = np.int32(0)
    for p in range(n):
        car = k[K_ORDER, p]
        k[K_BOX, boxing] = car
        boxing += np.int32(k[K_WANT, car] >= 0)
    return boxing


@kernel(inline="always")
def wait_for_mates(fig, f, k, boxing, n, lap, key0, key1):  # type: ignore[no-untyped-def]
    """F_RAW of a car that boxes: what it waits behind its team's other car, if that came in shortly before on the same lap, s."""
    for i in range(boxing):
        car = k[K_BOX, i]
        mate = fig.mates[car]
        f[F_RAW, car] = ZERO
        if mate < 0 or k[K_WANT, mate] < 0 or k[K_PLACE, mate] >= n:
            continue
        gap = f[F_TIME, car] - f[F_TIME, mate]
        if gap > ZERO or (gap == ZERO and k[K_PLACE, mate] < k[K_PLACE, car]):
            f[F_RAW, car] = max(fig.track[T_STACK] + stop_excess(fig, mate, lap, key0, key1) - gap, ZERO)


@kernel(inline="always")
def take_stops(fig, plans, f, k, r, lap, key0, key1):  # type: ignore[no-untyped-def]
    """Pit-lane loss, stop time, wait and new tyres for the cars that box at the end of this lap. Under a red flag it costs nothing.

    The whole loss counts at once, so that a car meets the traffic it comes out into; lap times show it over two laps.
    """
    status = r[R_STATUS]
    boxing = list_stops(k, r[R_RUNNING])
    if status != RED:
        wait_for_mates(fig, f, k, boxing, r[R_RUNNING], lap, key0, key1)
    for i in range(boxing):
        car = k[K_BOX, i]
        want = k[K_WANT, car]
        if status != RED:
            loss = fig.track[T_PIT + status] + fig.cars[C_STOP, car] + stop_excess(fig, car, lap, key0, key1) + f[F_RAW, car]
            shown = loss * fig.track[T_IN_SHARE]
            f[F_TIME, car] += loss
            f[F_LAP, car] += shown
            f[F_DUE, car] = loss - shown
        k[K_STOPS, car] += 1
        k[K_STOPPED, car] = 1
        if r[R_WATCHED] == 1:
            change_set(fig, f, car)
        fit_tyre(fig, f, k, car, want, key0, key1)
        f[F_COLD, car] = fig.tyres[want, Y_COLD]
        if k[K_PLAN, car] >= 0:
            k[K_POINTER, car] += 1
            load_next_stop(fig, plans, k, car, lap, key0, key1)
