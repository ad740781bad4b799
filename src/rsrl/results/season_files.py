"""Results of the scripts in `benchmarks/` that hold the shipped season files against the races they are of."""

from rsrl.results.base import Interval, Number, Provenance, Result


class PassesRace(Result, frozen=True):
    """Passes on track in one race: real ones, and means of simulated races with their standard errors."""

    race: str
    season: int
    real: float
    real_stops: float
    real_stops_se: float
    rivals_decide: float
    rivals_decide_se: float


class PassesRatio(Result, frozen=True):
    """Simulated passes a race, and their ratio to the real ones with its interval over races."""

    passes: float
    ratio: Number
    ci95: Interval


class PassesSeason(Result, frozen=True):
    """The dry races of a season, `all` for those of every season: simulated with the real stops, and with rivals that decide theirs."""

    season: str
    races: int
    real: float
    real_stops: PassesRatio
    rivals_decide: PassesRatio


class PassesResult(Result, frozen=True):
    """Of `benchmarks/passes.py`."""

    simulated_races: int
    seasons: tuple[PassesSeason, ...]
    races: tuple[PassesRace, ...]
    provenance: Provenance
