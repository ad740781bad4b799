"""Pools one figure that every race gives: population mean, and deviations of tracks, seasons and races."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rsrl.calibration.bounded import truncated
from rsrl.calibration.entry import RaceKey
from rsrl.calibration.pooling.mixed_effects import Group, Mixed, Terms, fit_mixed
from rsrl.season import Figure


class Spread(NamedTuple):
    """Prior of a figure: population mean and its sd, and the scale of its spread between tracks, seasons and races."""

    mean: float
    sd: float
    track: float
    season: float
    race: float


@dataclass(frozen=True)
class PooledScalar:
    """A pooled figure, for any race."""

    model: Mixed | None
    spread: Spread
    races: tuple[RaceKey, ...]

    def at(self, race: RaceKey, low: float = float("-inf"), high: float = float("inf")) -> Figure:
        """The figure of a race, between bounds; of a track or season not among the races pooled, with the whole spread in its error."""
        if self.model is None:
            total = sum(s**2 for s in self.spread[1:]) ** 0.5
            return truncated(Figure(self.spread.mean, total, 0, "no race to estimate it from: assumed"), low, high)
        value, se = self.model.predict(_terms(race))
        here = sum(p.circuit == race.circuit for p in self.races)
        note = f"pooled over {len(self.races)} races, {here} of them here"
        return truncated(Figure(value, se, len(self.races), note), low, high)


def pool_scalar(values: Sequence[tuple[RaceKey, Figure]], spread: Spread, se_floor: float) -> PooledScalar:
    """Pool the figures of races; standard errors below `se_floor` are raised to it."""
    if not values:
        return PooledScalar(None, spread, ())
    groups = {
        "all": Group(spread.sd, spread.mean, learned=False),
        "track": Group(spread.track),
        "season": Group(spread.season),
        "race": Group(spread.race),
    }
    rows = [_terms(race) for race, _ in values]
    variances = [max(f.se, se_floor) ** 2 for _, f in values]
    return PooledScalar(fit_mixed([f.value for _, f in values], variances, rows, groups), spread, tuple(race for race, _ in values))


def _terms(race: RaceKey) -> Terms:
    return {("all", "all"): 1.0, ("track", race.circuit): 1.0, ("season", str(race.season)): 1.0, ("race", race.label): 1.0}
