"""Places for labels beside the ends of lines, moved apart just as far as they need."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def spread(values: Sequence[float], gap: float, low: float = -np.inf, high: float = np.inf) -> NDArray[np.float64]:
    """Places as near to `values` as possible, in squares, with at least `gap` between neighbours, in the same order.

    Least squares under an order with gaps is isotonic regression of `values - rank * gap` (pool adjacent violators): neighbours that are
    too close become one block around their mean. Where all fit between `low` and `high` they are kept within.

    Args:
        values: where the labels belong, [n].
        gap: least distance, in the units of `values`.
        low, high: ends of the axis.

    Returns:
        float64 [n], in the order of `values`.
    """
    wanted = np.asarray(values, np.float64)
    order = np.argsort(wanted, kind="stable")
    blocks: list[list[float]] = []  # mean of wanted - rank * gap, members
    for rank, index in enumerate(order):
        blocks.append([float(wanted[index]) - rank * gap, 1.0])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            mean, n = blocks.pop()
            blocks[-1] = [(blocks[-1][0] * blocks[-1][1] + mean * n) / (blocks[-1][1] + n), blocks[-1][1] + n]
    room = high - (len(wanted) - 1) * gap  # the least of the shifted places must not lie above it
    shifted = np.repeat([b[0] for b in blocks], [int(b[1]) for b in blocks])
    if room >= low:
        shifted = np.clip(shifted, low, room)
    places = np.empty(len(wanted))
    places[order] = shifted + np.arange(len(wanted)) * gap
    return places
