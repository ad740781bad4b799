"""Simulated races written as a lap table, for tests that fit figures which are known."""

import dataclasses
import gzip
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from rsrl.calibration.race_facts import RaceFacts, race_facts
from rsrl.laps import LAP_SCHEMA, check_table
from rsrl.season import COMPOUNDS, Figure, RaceRecord, load_race
from rsrl.simulator import Trace, trace_races

LANE_S = 25.0
C_NUMBERS = {"S": "C3", "M": "C2", "H": "C1"}
COMPOUND_NAMES = {"S": "SOFT", "M": "MEDIUM", "H": "HARD", "I": "INTERMEDIATE"}


def figure(value: float) -> Figure:
    return Figure(value, 0.0, 1)


def known_record(**track: float) -> RaceRecord:
    """The shipped Bahrain record with figures of our own choice, away from every prior, and no incidents."""
    shipped = load_race("bahrain-2023")
    wear = {"S": (-0.45, 0.17), "M": (0.0, 0.13), "H": (0.35, 0.095)}
    tyres = {
        c: dataclasses.replace(
            shipped.tyres[c],
            offset_s=figure(wear[c][0]),
            wear_s_per_lap=figure(wear[c][1]),
            curvature_s_per_lap2=figure(0.0),
            cold_loss_s=figure(1.0),
            sets=5,
        )
        for c in COMPOUNDS
    }
    chosen = {
        "base_lap_s": 94.0,
        "fuel_s_per_kg": 0.036,
        "fuel_start_kg": 110.0,
        "lap_noise_sd_s": 0.2,
        "evolution_s": 0.5,
        "stint_sd_s": 0.0,
    } | track
    incidents = dataclasses.replace(
        shipped.incidents,
        sc_lap1=figure(0.0),
        red_share=figure(0.0),
        sc_per_lap=figure(track.pop("sc", 0.0)),
        vsc_per_lap=figure(track.pop("vsc", 0.0)),
    )
    cars = tuple(
        dataclasses.replace(
            car,
            form_sd_s=figure(0.0),
            retire_per_lap=figure(0.0),
            retire_lap1=figure(0.0),
            noise_factor=figure(1.0),
            start_gain_s=figure(0.0),
            stop_loss_s=figure(0.0),
        )
        for car in shipped.cars
    )
    changes: dict[str, Any] = {k: figure(v) for k, v in chosen.items() if k not in ("sc", "vsc")}
    return dataclasses.replace(
        shipped,
        track=dataclasses.replace(shipped.track, **changes),
        tyres=tyres,
        incidents=incidents,
        cars=cars,
    )


def lap_table(record: RaceRecord, trace: Trace, season: int, rounds: range, seed: int = 0) -> pl.DataFrame:
    """Races of a trace as rounds of a season. Pit-lane times are `LANE_S` plus the record's log-logistic excess, drawn here."""
    rng = np.random.default_rng(seed)
    rows: list[tuple[object, ...]] = []
    scale, shape = record.pit.tail_scale_s.value, record.pit.tail_shape.value
    for i, number in enumerate(rounds):
        for car, figures in enumerate(record.cars):
            stint, pit_out = 1, None
            for lap in range(record.laps):
                if not trace.running[i, lap, car]:
                    break
                letter = COMPOUNDS[trace.compound[i, lap, car]]
                session = 3600.0 + float(trace.race_time_s[i, lap, car])
                stopped = bool(trace.stopped[i, lap, car])
                u = rng.uniform(0.001, 0.999)
                lane = LANE_S + scale * (u / (1 - u)) ** (1 / shape)
                digits = "1" if trace.track_status[i, lap] == 0 else ("6" if trace.track_status[i, lap] == 1 else "4")
                rows.append(
                    (season, number, record.event, figures.driver, figures.team, lap + 1, float(trace.lap_time_s[i, lap, car]), letter,
                     C_NUMBERS[letter], float(trace.tyre_age_laps[i, lap, car]), stint, int(trace.place[i, lap, car]), digits,
                     session if stopped else None, pit_out, session, True, "timing")
                )  # fmt: skip
                pit_out = session + lane if stopped else None
                stint += stopped
    return check_table(pl.DataFrame(rows, schema=LAP_SCHEMA, orient="row"), "simulated laps", 0)


def simulated(record: RaceRecord, seed: int, seasons: tuple[int, ...] = (2022, 2023)) -> pl.DataFrame:
    """One race a season, of one seed."""
    trace = trace_races(record, len(seasons), seed)
    parts = []
    for i, season in enumerate(seasons):
        one = Trace(*(getattr(trace, f.name)[i : i + 1] for f in dataclasses.fields(trace)))
        parts.append(lap_table(record, one, season, range(1, 2), seed + i))
    return pl.concat(parts)


def facts_of(record: RaceRecord, race: pl.DataFrame) -> RaceFacts:
    """What the results table would say of a simulated race: the record's grid, the rest from the laps."""
    season, number = race.select("season", "round").row(0)
    seen = race_facts(race, None, season, number)
    teams = {car.driver: car.team for car in record.cars}
    return dataclasses.replace(seen, teams=teams, grid={car.driver: car.grid for car in record.cars}, laps=record.laps, source="simulated")


def write_season(table: pl.DataFrame, folder: Path, season: int) -> None:
    """The season's laps of a table as `laps_<season>.csv.gz` in a folder."""
    out = table.filter(pl.col("season") == season).with_columns(pl.col("compound").replace(COMPOUND_NAMES))
    out = out.rename({"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"})
    (folder / f"laps_{season}.csv.gz").write_bytes(gzip.compress(out.write_csv().encode()))
