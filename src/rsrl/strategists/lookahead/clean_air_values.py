"""Value function of a car alone on the track: expected cost to the flag for every compound, age and stint offset, with safety cars.

Backward dynamic programming as in `state.outlook`, with two additions that make waiting worthwhile: a set may turn out quicker or slower
than its compound (the stint offset), which shows within a few laps; and a stop under a safety car is cheap. A safety car is modelled as a
single lap after a green one; its further laps are ignored.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.rollouts import CostToGo
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.state import expected_stop_s
from rsrl.state.outlook import IMPOSSIBLE_S, lap_cost

GRID_POINTS: Final = 9
GRID_SDS: Final = 2.4
"""The stint offset is discretised at this many points, from minus to plus this many standard deviations."""

STATUSES: Final = (GREEN, VSC, SC, RED)


def clean_air_values(figures: Figures, car: int) -> CostToGo:
    """Cost to go of one car; its stops cost their mean loss, and later ones fit the freshest set it began with."""
    laps, limit = int(figures.whole[at.I_LAPS]), int(figures.whole[at.I_MAX_LAPS_PER_SET])
    offset_s, weight = offset_grid(float(figures.track[at.T_STINT]))
    price = np.array([expected_stop_s(figures, car, status) for status in STATUSES])
    wear = np.array([[float(lap_cost(figures.tyres, c, age)) for age in range(laps + 1)] for c in range(3)])
    if limit:
        wear[:, limit:] = float(IMPOSSIBLE_S)
    lap_s, cold_s = wear[None, :, :, None] + offset_s, figures.tyres[:, at.Y_COLD].astype(np.float64)
    before = figures.laps_before[:, :, car]
    value, new = np.zeros((laps + 1, 2, 3, laps + 1, GRID_POINTS)), np.zeros((laps + 1, 2, *before.shape))
    value[laps, 0] = float(IMPOSSIBLE_S)
    for lap in range(laps - 1, -1, -1):
        stay = np.concatenate([value[lap + 1, :, :, 1:], value[lap + 1, :, :, -1:]], axis=2)
        # no stop takes effect on the last lap
        to_come = stay if lap + 1 == laps else _best_expected(stay, new[lap + 1, :, :, 0], price, _status_probabilities(figures))
        value[lap] = np.minimum(lap_s + to_come, float(IMPOSSIBLE_S))
        for age in np.unique(before):
            fitted = value[lap, :, :, age] @ weight + cold_s
            new[lap] = np.where(before == age, fitted[:, :, None], new[lap])
    grid = np.array([offset_s[0], offset_s[1] - offset_s[0]], np.float32)
    return CostToGo(value.astype(np.float32), new.astype(np.float32), price.astype(np.float32), grid)


def offset_grid(sd_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Grid points of a normal stint offset in s, of standard deviation `sd_s`, and their probabilities; mean and variance are exact."""
    z = np.linspace(-GRID_SDS, GRID_SDS, GRID_POINTS)
    weight = np.exp(-z * z / 2)
    weight /= weight.sum()
    return sd_s * z / np.sqrt(weight @ (z * z)), weight


def _best_expected(
    stay: NDArray[np.float64], new: NDArray[np.float64], price: NDArray[np.float64], probability: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Expected cost from the end of a lap on, over its track status, of the better of staying out and a new set.

    Args:
        stay: cost of staying out [two used, compound, ages, offsets].
        new: cost of the freshest set [two used, compound], its stop left out.
        price: cost of a stop by track status.
        probability: of each track status.
    """
    box = _best_new(new)[:, :, None, None]
    expected = np.zeros_like(stay)
    for status in STATUSES:
        best = np.minimum(stay, box + price[status])
        if status != GREEN:
            best[:, :, : at.MIN_STINT_LAPS] = stay[:, :, : at.MIN_STINT_LAPS]
        expected += probability[status] * best
    return expected


def _status_probabilities(figures: Figures) -> NDArray[np.float64]:
    """Probability of each track status on a lap after a green one, by code."""
    sc, vsc, red = (float(figures.track[i]) for i in (at.T_SC, at.T_VSC, at.T_RED))
    return np.array([1 - sc - vsc, vsc, sc * (1 - red), sc * red])


def _best_new(new: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cost of the best set [two used, compound taken off], from the cost of the freshest set of each compound [two used, compound]."""
    best = np.broadcast_to(new[1].min(), (2, 3)).copy()
    for before in range(3):
        best[0, before] = min(new[int(c != before), c] for c in range(3))
    return best
