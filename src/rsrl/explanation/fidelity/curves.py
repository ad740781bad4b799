"""Insertion and deletion curves (Petsiuk et al., 2018) of an attribution, beside those of random orders."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.attribution.values import ValueFunction

Doubles = NDArray[np.float64]

RANDOM_ORDERS: Final = 200
POINTS: Final = 11
"""Points a mean curve is given at, from no player to all."""

FEWEST_PLAYERS: Final = 5
"""Decisions in which fewer players count have no curves: four in random order stand as the attribution has them one time in 24, so that
no order can be outside the band."""

BAND: Final = (0.025, 0.975)


@dataclass(frozen=True)
class Curves:
    """Curves of one decision, in units of the sum of its absolute shares, from 0 at the background on; [POINTS].

    Attributes:
        insertion: players told one after the other, those that speak most for the call first: it should rise fast.
        deletion: players taken away in that order: it should fall fast.
        random: [RANDOM_ORDERS, POINTS], insertion in random orders.
    """

    insertion: Doubles
    deletion: Doubles
    random: Doubles


def curves(v: ValueFunction, weights: Doubles, shares: Doubles, rng: np.random.Generator) -> Curves:
    """Curves of one decision; players whose share is zero are left out. `weights` [4] of the calls, `shares` [n]."""
    players = np.flatnonzero(shares)
    best_first = players[np.argsort(-shares[players], kind="stable")]
    orders = np.stack([best_first, best_first[::-1], *(rng.permutation(players) for _ in range(RANDOM_ORDERS))])
    place = np.full((len(orders), v.count), len(players))
    np.put_along_axis(place, orders, np.arange(len(players)), axis=1)
    masks = place[:, None, :] < np.arange(len(players) + 1)[:, None]
    values = (v(masks.reshape(-1, v.count)) @ weights).reshape(len(orders), -1)
    scaled = (values - values[:, :1]) / np.abs(shares).sum()
    grid = np.linspace(0, len(players), POINTS)
    told = np.array([np.interp(grid, np.arange(len(players) + 1), row) for row in scaled])
    return Curves(told[0], told[1][::-1], told[2:])  # worst first, read backwards, is best first taken away


def curve_figures(all_curves: Sequence[Curves]) -> dict[str, Any]:
    """Mean curves over decisions beside the band of mean curves of random orders, and how many decisions' areas lie outside their own."""
    if not all_curves:
        return {"decisions": 0}
    random = np.stack([c.random for c in all_curves])  # [D, RANDOM_ORDERS, POINTS]
    figures: dict[str, Any] = {"decisions": len(all_curves)}
    for name, side in (("insertion", 1), ("deletion", -1)):
        each = np.stack([getattr(c, name) for c in all_curves])
        others = random if name == "insertion" else random[:, :, ::-1]
        low, high = np.quantile(others.mean(axis=0), BAND, axis=0)
        mean, beyond = each.mean(axis=0), high if side > 0 else low
        areas, random_areas = each.mean(axis=1), others.mean(axis=2)
        limit = np.quantile(random_areas, BAND[1] if side > 0 else BAND[0], axis=1)
        figures[name] = {
            "curve": mean.tolist(),
            "random_low": low.tolist(),
            "random_high": high.tolist(),
            "outside_band_share_of_points": float((side * (mean - beyond)[1:-1] > 0).mean()),
            "decisions_outside_their_band": float((side * (areas - limit) > 0).mean()),
            "area": float(areas.mean()),
            "area_random": float(random_areas.mean()),
        }
    return figures
