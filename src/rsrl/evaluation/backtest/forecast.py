"""A race as it could be known before it was run: pooled figures of the races before it, its entry, its grid and its qualifying."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration import (
    ChoiceFits,
    EarlierPassing,
    FormBook,
    PastLevel,
    PastRace,
    RaceAnalysis,
    RaceEntry,
    RaceFacts,
    analyse_seasons,
    choices_in,
    earlier_passing,
    entry_from,
    forecast_base_lap,
    forecast_pace,
    lap_figures_of,
    pace_figures,
    pool,
    race_facts,
    read_history,
    retirement_factors,
)
from rsrl.errors import RsrlError
from rsrl.laps import RACE, read_seasons
from rsrl.season import CarFigures, Figure, RaceRecord

MIN_PACE_LAPS: Final = 12
PACE_LIMITS: Final = (-2.0, 2.5)  # per cent: beyond them a race pace is a broken car's
Steps = Callable[[int, int], None]


@dataclass(frozen=True)
class Season:
    """Everything the backtest of a season needs, race by race in the order they were run; read once, used for every mode."""

    fit: tuple[int, ...]
    test: int
    table: pl.DataFrame
    facts_folder: Path | None
    analyses: tuple[RaceAnalysis, ...]
    book: FormBook
    fits: ChoiceFits
    passing: tuple[EarlierPassing, ...] = ()

    @property
    def test_indices(self) -> list[int]:
        """Races of the test season."""
        return [i for i, race in enumerate(self.book.races) if race.season == self.test]

    def name(self, index: int) -> str:
        """Such as `bahrain-2024`."""
        return self.analyses[index].entry.name

    def laps_of(self, index: int) -> pl.DataFrame:
        """All laps of one race."""
        race = self.book.races[index]
        return self.table.filter((pl.col("season") == race.season) & (pl.col("round") == race.round))


def read_season(laps_folder: Path, facts_folder: Path | None, fit: tuple[int, ...], test: int, progress: Steps | None = None) -> Season:
    """Read and analyse the seasons, each race by itself. Raises RsrlError for files that cannot be read or lack the test season."""
    seasons = tuple(sorted({*fit, test}))
    table = read_seasons(laps_folder, seasons)
    analyses = tuple(analyse_seasons(table, facts_folder, progress))
    if not any(a.entry.season == test for a in analyses):
        raise RsrlError(f"no whole race of {test} in {laps_folder}; give the folder with laps_{test}.csv.gz")
    past = [_past_race(a, race_facts(_laps(table, a.entry), facts_folder, a.entry.season, a.entry.round)) for a in analyses]
    fits = ChoiceFits(choices_in(laps_folder, facts_folder, test), lap_figures_of(analyses))
    passing = earlier_passing(laps_folder, facts_folder, [a for a in analyses if a.entry.season in fit])
    return Season(tuple(sorted(fit)), test, table, facts_folder, analyses, FormBook(past), fits, passing)


def _laps(table: pl.DataFrame, entry: RaceEntry) -> pl.DataFrame:
    return table.filter((pl.col(RACE[0]) == entry.season) & (pl.col(RACE[1]) == entry.round))


def _past_race(analysis: RaceAnalysis, facts: RaceFacts) -> PastRace:
    """Pace against the median car, per cent of a lap, of cars with `MIN_PACE_LAPS`."""
    entry = analysis.entry
    if analysis.pace is None:
        return PastRace(entry.season, entry.round, entry.wet, facts, {})
    paces = {d: p.value / analysis.pace.base_lap_s.value * 100 for d, p in analysis.pace.cars.items() if p.n >= MIN_PACE_LAPS}
    middle = float(np.median(list(paces.values()))) if paces else 0.0
    clipped = {d: float(np.clip(p - middle, *PACE_LIMITS)) for d, p in paces.items()}
    return PastRace(entry.season, entry.round, entry.wet, facts, clipped)


def _level(analysis: RaceAnalysis, facts: RaceFacts) -> PastLevel | None:
    if analysis.pace is None:
        return None
    return PastLevel(analysis.entry.circuit, analysis.entry.season, analysis.pace.base_lap_s.value, median_quali_s(facts))


def median_quali_s(facts: RaceFacts) -> float:
    """Median of the best qualifying laps, nan where there are none."""
    return float(np.median(list(facts.quali_s.values()))) if facts.quali_s else float("nan")


def forecast_record(season: Season, index: int, *, choices: bool = True) -> RaceRecord:
    """The record of race `index` from the races before it; of the race itself only entry, grid, nominated tyres and qualifying are used.

    `choices`: whether its tyres go by what teams chose as well as by lap times.
    """
    race = season.book.races[index]
    before = season.analyses[:index]
    history = read_history(season.facts_folder, (race.season, race.round)) if season.facts_folder else ()
    chosen = season.fits.before(race.season, race.round) if choices else None
    model = pool(before, history, choices=chosen, passing=season.passing)
    entry = entry_from(_laps(season.table, season.analyses[index].entry), season.facts_folder, race.season, race.round)
    levels = [_level(a, r.facts) for a, r in zip(before, season.book.races, strict=False)]
    base = forecast_base_lap([lv for lv in levels if lv], entry.circuit, race.season, median_quali_s(race.facts))
    forecast = forecast_pace(season.book, index)
    known = {d: sum(d in r.pace for r in season.book.races[:index]) for d in race.facts.grid}
    record = model.record(entry, pace_figures(forecast, base.value, known), base)
    form = Figure(forecast.sd * base.value / 100, 0.0, forecast.rows, "spread of race pace about its forecast before the race")
    factors = retirement_factors(season.book, index)
    return replace(record, cars=tuple(_forecast_car(car, form, factors[car.driver]) for car in record.cars))


def _forecast_car(car: CarFigures, form: Figure, factor: float) -> CarFigures:
    """The car with the spread of its forecast, and its hazards by place on the grid besides team and track."""
    note = f"{car.retire_per_lap.note}; x{factor:.2f} for its place on the grid"
    later = car.retire_per_lap._replace(value=car.retire_per_lap.value * factor, note=note)
    return replace(car, form_sd_s=form, retire_per_lap=later, retire_lap1=car.retire_lap1._replace(value=car.retire_lap1.value * factor))
