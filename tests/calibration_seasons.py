"""Seasons of simulated races with figures of our own choice, analysed: for tests of what is pooled."""

import dataclasses
from functools import lru_cache

import polars as pl
from calibration_laps import C_NUMBERS, facts_of, figure, known_record, lap_table

from rsrl.calibration import RaceAnalysis, analyse_race
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import Trace, trace_races

EVENTS = {"bahrain": "Bahrain Grand Prix", "spain": "Spanish Grand Prix", "canada": "Canadian Grand Prix"}
SEVERITY = {"bahrain": 0.05, "spain": 0.0, "canada": -0.05}  # wear beyond the known record's, s per lap
THRESHOLD_S = {"bahrain": 0.5, "spain": 1.0, "canada": 1.7}
PIT_S = {"bahrain": 22.0, "spain": 20.0, "canada": 18.0}
SEASONS = (2023, 2024)


def known_track(slug: str, season: int) -> RaceRecord:
    """The known record moved to a track: its own wear, passing and pit loss."""
    record = known_record(
        pass_threshold_s=THRESHOLD_S[slug], pass_per_gap=1.5, stint_sd_s=0.1, passed_loss_s=0.7, dirty_air_loss_s=0.25,
        dirty_air_window_s=4.25,
    )  # fmt: skip
    tyres = {
        c: dataclasses.replace(record.tyres[c], wear_s_per_lap=figure(record.tyres[c].wear_s_per_lap.value + SEVERITY[slug]))
        for c in COMPOUNDS
    }
    pit = dataclasses.replace(record.pit, loss_green_s=figure(PIT_S[slug]), in_lap_share=figure(0.8))
    return dataclasses.replace(record, event=EVENTS[slug], grand_prix=slug, season=season, name=f"{slug}-{season}", tyres=tyres, pit=pit)


@lru_cache(maxsize=1)
def known_seasons() -> tuple[RaceAnalysis, ...]:
    """Two seasons of three tracks, one race each, analysed; made once for all tests."""
    found = []
    for season in SEASONS:
        for number, slug in enumerate(EVENTS, 1):
            record = known_track(slug, season)
            trace = trace_races(record, 1, 10 * season + number + 5)
            race = one_race(record, trace, season, number)
            found.append(analyse_race(race, facts_of(record, race), C_NUMBERS))
    return tuple(found)


def one_race(record: RaceRecord, trace: Trace, season: int, number: int) -> pl.DataFrame:
    """Laps of the first race of a trace."""
    return lap_table(record, trace, season, range(number, number + 1), seed=number)
