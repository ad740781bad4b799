"""Pooling of one figure that every race gives: the population, each track's own, what moves from season to season and race to race."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rsrl.calibration.pooling.mixed_effects import Group, Mixed, Terms, fit_mixed
from rsrl.season import Figure


class Place(NamedTuple):
    """Where and when: what a figure may depend on."""

    track: str
    season: int
    round: int

    @property
    def race(self) -> str:
        """Label of the race."""
        return f"{self.season}/{self.round}"


class Spread(NamedTuple):
    """Prior of a figure: population mean and its sd, and the scales of how it varies; none: it does not."""

    mean: float
    sd: float
    track: float
    season: float
    race: float


@dataclass(frozen=True)
class PooledScalar:
    """A pooled figure, ready for any place."""

    model: Mixed | None
    spread: Spread
    places: tuple[Place, ...]

    def at(self, place: Place, low: float = float("-inf"), high: float = float("inf")) -> Figure:
        """The figure at a place, within bounds; its error holds what is not known of a track or a season nobody has raced."""
        if self.model is None:
            total = sum(s**2 for s in self.spread[1:]) ** 0.5
            return Figure(min(max(self.spread.mean, low), high), total, 0, "no race given tells: assumed")
        value, se = self.model.predict(_terms(place))
        here = sum(p.track == place.track for p in self.places)
        note = f"pooled over {len(self.places)} races, {here} of them here"
        return Figure(min(max(value, low), high), se, len(self.places), note)


def pool_scalar(values: Sequence[tuple[Place, Figure]], spread: Spread, se_floor: float) -> PooledScalar:
    """Pool; standard errors below `se_floor` are taken as that."""
    if not values:
        return PooledScalar(None, spread, ())
    groups = {
        "all": Group(spread.sd, spread.mean, learned=False),
        "track": Group(spread.track),
        "season": Group(spread.season),
        "race": Group(spread.race),
    }
    rows = [_terms(place) for place, _ in values]
    variances = [max(f.se, se_floor) ** 2 for _, f in values]
    return PooledScalar(fit_mixed([f.value for _, f in values], variances, rows, groups), spread, tuple(p for p, _ in values))


def _terms(place: Place) -> Terms:
    return {("all", "all"): 1.0, ("track", place.track): 1.0, ("season", str(place.season)): 1.0, ("race", place.race): 1.0}
