"""Seasons that the simulator ran, written as the lap and facts files that `rsrl backtest` reads."""

import csv
import dataclasses
import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
from calibration_laps import C_NUMBERS, figure, write_season
from calibration_seasons import EVENTS, known_track, one_race

from rsrl.season import CarFigures, RaceRecord
from rsrl.simulator import Trace, trace_races

FIT, TEST = (2031, 2032), 2033
PASS_S = {"bahrain": 0.7, "spain": 1.3, "canada": 2.2}  # thresholds of passing, whatever the gap
TRACKS = {**{slug: (slug, event) for slug, event in EVENTS.items()}, "hungary": ("spain", "Hungarian Grand Prix")}
"""Grand Prix to the known track with its figures, and the event's name."""

TEST_TRACKS = ("bahrain", "spain")
GRID_SD_S = 0.5
"""Of qualifying about race pace: the grid says something of a race, but less than the races before it."""

Rows = list[dict[str, object]]


@dataclasses.dataclass(frozen=True)
class InventedRace:
    """One simulated race as it enters the files."""

    season: int
    round: int
    record: RaceRecord
    trace: Trace

    @property
    def laps(self) -> pl.DataFrame:
        """Its lap table."""
        return one_race(self.record, self.trace, self.season, self.round)

    @property
    def laps_done(self) -> list[int]:
        """Laps completed by each car."""
        return [int(n) for n in self.trace.running[0].sum(axis=0)[: len(self.record.cars)]]

    @property
    def positions(self) -> list[int]:
        """Result of each car: by laps completed, then by time."""
        done = self.laps_done
        ends = [float(self.trace.race_time_s[0, max(n - 1, 0), i]) for i, n in enumerate(done)]
        order = sorted(range(len(done)), key=lambda i: (-done[i], ends[i]))
        return [order.index(i) + 1 for i in range(len(done))]


def invented_races() -> list[InventedRace]:
    """Two seasons to learn from and the first races of a third. A driver keeps his pace; the grid is drawn anew for each race."""
    rng = np.random.default_rng(5)
    found = []
    for season in (*FIT, TEST):
        for number, slug in enumerate(TRACKS if season != TEST else TEST_TRACKS, 1):
            like, event = TRACKS[slug]
            record = known_track(like, season)
            track = dataclasses.replace(record.track, pass_threshold_s=figure(PASS_S[like]), pass_per_gap=None)
            record = dataclasses.replace(record, event=event, track=track, cars=_on_the_grid(record, rng))
            found.append(InventedRace(season, number, record, trace_races(record, 1, 100 * (season - FIT[0]) + number)))
    return found


def _on_the_grid(record: RaceRecord, rng: np.random.Generator) -> tuple[CarFigures, ...]:
    quick = np.array([car.pace_s.value for car in record.cars]) + rng.normal(0.0, GRID_SD_S, len(record.cars))
    cars = [record.cars[i] for i in np.argsort(quick)]
    return tuple(dataclasses.replace(car, grid=i + 1, retire_per_lap=figure(0.002)) for i, car in enumerate(cars))


def write_files(races: Sequence[InventedRace], folder: Path) -> None:
    """`laps/` and `facts/` of the races in a folder."""
    (folder / "laps").mkdir()
    (folder / "facts").mkdir()
    for season in sorted({r.season for r in races}):
        write_season(pl.concat([r.laps for r in races if r.season == season]), folder / "laps", season)
    for name, rows in _facts(races).items():
        with (folder / "facts" / f"{name}.csv").open("w", encoding="utf-8", newline="") as handle:
            writer = csv.DictWriter(handle, fieldnames=list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)


def _facts(races: Sequence[InventedRace]) -> dict[str, Rows]:
    drivers = sorted({car.driver for r in races for car in r.record.cars})
    teams = sorted({car.team for r in races for car in r.record.cars})
    results: Rows = []
    qualifying: Rows = []
    for i, race in enumerate(races):
        for car, position, done in zip(race.record.cars, race.positions, race.laps_done, strict=True):
            ids = {"raceId": i, "driverId": drivers.index(car.driver), "constructorId": teams.index(car.team)}
            out = done < race.record.laps
            text = "R" if out else position
            results.append(ids | {"grid": car.grid, "positionOrder": position, "positionText": text, "laps": done, "statusId": int(out)})
            lap_s = 0.97 * race.record.track.base_lap_s.value + 0.05 * car.grid
            qualifying.append(ids | {"q1": f"{int(lap_s // 60)}:{lap_s % 60:06.3f}", "q2": "", "q3": ""})
    return {
        "ergast_races": [{"raceId": i, "year": r.season, "round": r.round, "name": r.record.event} for i, r in enumerate(races)],
        "ergast_drivers": [{"driverId": i, "code": code} for i, code in enumerate(drivers)],
        "ergast_constructors": [{"constructorId": i, "name": name} for i, name in enumerate(teams)],
        "ergast_status": [{"statusId": 0, "status": "Finished"}, {"statusId": 1, "status": "Engine"}],
        "ergast_results": results,
        "ergast_qualifying": qualifying,
        "safety_cars": [{"Race": "2000 Monaco Grand Prix", "Deployed": 1}],
        "red_flags": [{"Race": "2000 Monaco Grand Prix", "Lap": 1}],
    }


def scramble(folder: Path) -> None:
    """Rewrite the test season in a folder: the order of pace, stops, tyres, track status and results. Grids and qualifying stay."""
    path = folder / "laps" / f"laps_{TEST}.csv.gz"
    table = pl.read_csv(path)
    rank = pl.col("driver").rank("dense")
    path.write_bytes(
        gzip.compress(
            table.with_columns(
                lap_time_s=pl.col("lap_time_s") * (1 + 0.002 * rank),
                session_time_s=pl.col("session_time_s") + 0.2 * rank * pl.col("lap"),
                position=21 - pl.col("position"),
                track_status=pl.when(pl.col("lap").is_between(20, 24)).then(4).otherwise("track_status"),
                compound=pl.col("compound").replace({"MEDIUM": "HARD", "HARD": "MEDIUM"}),
                compound_c=pl.col("compound_c").replace({C_NUMBERS["M"]: C_NUMBERS["H"], C_NUMBERS["H"]: C_NUMBERS["M"]}),
                **{name: pl.col(name).shift(3).over("round", "driver") for name in ("pit_in", "pit_out", "stint", "tyre_life")},
            )
            .write_csv()
            .encode()
        )
    )
    races, results = (folder / "facts" / f"ergast_{name}.csv" for name in ("races", "results"))
    tested = pl.read_csv(races).filter(pl.col("year") == TEST)["raceId"]
    rows = pl.read_csv(results, infer_schema_length=None)
    turned = rows.with_columns(
        positionOrder=21 - pl.col("positionOrder"),
        positionText=(21 - pl.col("positionOrder")).cast(pl.String),
        statusId=pl.when(pl.col("grid") % 5 == 0).then(1).otherwise(0),
    )
    rows.update(turned.filter(pl.col("raceId").is_in(tested.to_list())), on=["raceId", "driverId"]).write_csv(results)
