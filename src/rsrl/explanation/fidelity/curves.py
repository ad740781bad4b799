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
"""Points at which a mean curve is given, from no player to all."""

FEWEST_PLAYERS: Final = 5
"""Decisions with fewer players have no curves: one random order of four in 24 is the attribution's own, so that none can leave the band."""

BAND: Final = (0.025, 0.975)


@dataclass(frozen=True)
class Curves:
    """Curves of one decision [POINTS], in units of the sum of its absolute values, 0 at the background.

    Attributes:
        insertion: players shown one after the other, those that speak most for the call first; should rise fast.
        deletion: players removed in that order; should fall fast.
        random: insertion in random orders, [RANDOM_ORDERS, POINTS].
    """

    insertion: Doubles
    deletion: Doubles
    random: Doubles


def curves(v: ValueFunction, weights: Doubles, shapley: Doubles, rng: np.random.Generator) -> Curves:
    """Curves of one decision; players whose value is zero are left out.

    Args:
        weights: of the four calls in the value explained, [4].
        shapley: Shapley value of each player, [n].
    """
    players = np.flatnonzero(shapley)
    best_first = players[np.argsort(-shapley[players], kind="stable")]
    orders = np.stack([best_first, best_first[::-1], *(rng.permutation(players) for _ in range(RANDOM_ORDERS))])
    place = np.full((len(orders), v.count), len(players))
    np.put_along_axis(place, orders, np.arange(len(players)), axis=1)
    masks = place[:, None, :] < np.arange(len(players) + 1)[:, None]
    values = (v(masks.reshape(-1, v.count)) @ weights).reshape(len(orders), -1)
    scaled = (values - values[:, :1]) / np.abs(shapley).sum()
    grid = np.linspace(0, len(players), POINTS)
    at_points = np.array([np.interp(grid, np.arange(len(players) + 1), row) for row in scaled])
    return Curves(at_points[0], at_points[1][::-1], at_points[2:])  # inserting the worst first, read backwards, deletes the best first


def curve_figures(all_curves: Sequence[Curves]) -> dict[str, Any]:
    """Mean curves over decisions beside the 95 % band of random orders, and the share of decisions whose area is outside their own band."""
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
