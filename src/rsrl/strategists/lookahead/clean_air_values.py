"""Clean-air foresight: the expected cost to the flag of every tyre and age, with the track to oneself and safety cars by chance.

Dynamic programming from the flag back, as in `state.outlook`, with two things more that a strategist waits for: a stint turns out quicker
or slower than its compound, which shows within a few laps and makes the set worth keeping or not; and a stop under a safety car is cheap.
Each green lap may be followed by a caution of one lap; what a longer one brings besides is left out.
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

LUCKS: Final = 9
SPREAD: Final = 2.4
"""A stint's luck stands on a grid of `LUCKS`, so many standard deviations to either side."""

STATUSES: Final = (GREEN, VSC, SC, RED)


def foresee(figures: Figures, car: int) -> CostToGo:
    """Cost to go of one car, its stops at their mean loss."""
    laps, limit = int(figures.whole[at.I_LAPS]), int(figures.whole[at.I_MAX_LAPS_PER_SET])
    luck_s, share = lucks(float(figures.track[at.T_STINT]))
    price = np.array([expected_stop_s(figures, car, status) for status in STATUSES])
    wear = np.array([[float(lap_cost(figures.tyres, c, age)) for age in range(laps + 1)] for c in range(3)])
    if limit:
        wear[:, limit:] = float(IMPOSSIBLE_S)
    lap_s, cold_s = wear[None, :, :, None] + luck_s, figures.tyres[:, at.Y_COLD].astype(np.float64)
    value, new = np.zeros((laps + 1, 2, 3, laps + 1, LUCKS)), np.zeros((laps + 1, 2, 3))
    value[laps, 0] = float(IMPOSSIBLE_S)
    for lap in range(laps - 1, -1, -1):
        stay = np.concatenate([value[lap + 1, :, :, 1:], value[lap + 1, :, :, -1:]], axis=2)
        # no stop takes effect on the last lap
        to_come = stay if lap + 1 == laps else _best_expected(stay, new[lap + 1], price, _chances(figures))
        value[lap] = np.minimum(lap_s + to_come, float(IMPOSSIBLE_S))
        new[lap] = value[lap, :, :, 0] @ share + cold_s
    grid = np.array([luck_s[0], luck_s[1] - luck_s[0]], np.float32)
    return CostToGo(value.astype(np.float32), new.astype(np.float32), price.astype(np.float32), grid)


def lucks(sd_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Grid of a stint's luck in s, of standard deviation `sd_s`, and the share of each."""
    z = np.linspace(-SPREAD, SPREAD, LUCKS)
    share = np.exp(-z * z / 2)
    share /= share.sum()
    return sd_s * z / np.sqrt(share @ (z * z)), share


def _best_expected(
    stay: NDArray[np.float64], new: NDArray[np.float64], price: NDArray[np.float64], chances: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Cost from the end of a lap on, of the better of staying [2, 3, ages, lucks] and a new set [2, 3], over the lap's track status."""
    box = _best_new(new)[:, :, None, None]
    expected = np.zeros_like(stay)
    for status in STATUSES:
        best = np.minimum(stay, box + price[status])
        if status != GREEN:
            best[:, :, : at.MIN_STINT_LAPS] = stay[:, :, : at.MIN_STINT_LAPS]
        expected += chances[status] * best
    return expected


def _chances(figures: Figures) -> NDArray[np.float64]:
    """Chance of each track status on a lap after a green one, by its code."""
    sc, vsc, red = (float(figures.track[i]) for i in (at.T_SC, at.T_VSC, at.T_RED))
    return np.array([1 - sc - vsc, vsc, sc * (1 - red), sc * red])


def _best_new(new: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cost of the best new set [two used, compound that comes off] from that of each [two used, compound]."""
    best = np.broadcast_to(new[1].min(), (2, 3)).copy()
    for before in range(3):
        best[0, before] = min(new[int(c != before), c] for c in range(3))
    return best
