"""A season nobody has seen: new teams, circuits and rules, 22 cars, three races or a single one."""

import json
from pathlib import Path

import polars as pl
import pytest
from calibration_laps import write_season
from invented_2026 import CARS, NAMES, NEW_TEAMS, UNKNOWN_LAPS, season_2026
from test_calibration_race import some_seasons

from rsrl.cli import main
from rsrl.season import RaceRecord, load_race, race_names

Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def laps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("laps")
    write_season(season_2026(), path, 2026)
    return path


@pytest.fixture(scope="module")
def season(laps: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Season files of the three races, from these alone."""
    out = tmp_path_factory.mktemp("season") / "races"
    assert main(["calibrate", "--laps", str(laps), "--seasons", "2026", "--out", str(out), "--json"]) == 0
    return out


@pytest.fixture(scope="module")
def records(season: Path) -> dict[str, RaceRecord]:
    return {name: load_race(name, season) for name in race_names(season)}


def test_three_races_are_enough(season: Path, records: dict[str, RaceRecord]) -> None:
    assert tuple(records) == NAMES
    assert sorted(path.name for path in season.iterdir()) == sorted(f"{name}.toml" for name in NAMES)
    for record in records.values():
        assert len(record.cars) == CARS
        assert {car.team for car in record.cars} > set(NEW_TEAMS)
        assert [car.grid for car in record.cars] == list(range(1, CARS + 1))


def test_rules_of_2026_are_in_the_file(records: dict[str, RaceRecord]) -> None:
    for record in records.values():
        assert (record.following_aid, record.drs_off_laps, record.min_sets, record.max_laps_per_set) == ("overtake", 1, 2, 0)
        assert "not measured" in record.track.drs_gain_s.note
        assert record.track.drs_window_s.value == 1.0


def test_a_compound_without_c_number_is_the_usual_one_and_told(laps: Path, tmp_path: Path, capsys: Capture) -> None:
    assert main(["calibrate", "madrid-2026", "--laps", str(laps), "--out", str(tmp_path), "--json"]) == 0
    out, err = capsys.readouterr()
    assert [tyre.c_number for tyre in load_race("madrid-2026", tmp_path).tyres.values()] == ["C4", "C3", "C2"]
    assert "spain-2026: C-numbers unknown, the usual ones assumed" in err
    assert json.loads(out)["races"][0]["laps_unknown"] == 0


def test_laps_on_unknown_tyres_are_told(laps: Path, tmp_path: Path, capsys: Capture) -> None:
    assert main(["calibrate", "2026 Grand Prix of Atlantis", "--laps", str(laps), "--out", str(tmp_path), "--json"]) == 0
    out, err = capsys.readouterr()
    result = json.loads(out)
    assert result["races"][0]["laps_unknown"] == UNKNOWN_LAPS
    assert f"atlantis-2026: {UNKNOWN_LAPS} laps on unknown tyres left out" in err
    assert {row["filter"]: row["removed"] for row in result["attrition"]}["unknown compound"] == UNKNOWN_LAPS


def test_a_race_alone_is_enough_and_is_less_sure(records: dict[str, RaceRecord], tmp_path: Path) -> None:
    write_season(season_2026(1), tmp_path, 2026)
    assert main(["calibrate", "barcelona-2026", "--laps", str(tmp_path), "--out", str(tmp_path / "alone.toml")]) == 0
    alone, season = load_race(tmp_path / "alone.toml"), records["barcelona-2026"]
    assert alone.rivals.plans
    for figure in ("loss_green_s", "tail_scale_s"):
        assert getattr(alone.pit, figure).se >= getattr(season.pit, figure).se
    assert sum(f.se for f in alone.rivals.hazard.values()) > sum(f.se for f in season.rivals.hazard.values())


def test_a_circuit_has_the_history_of_whatever_was_held_there(laps: Path, tmp_path: Path) -> None:
    """Barcelona's race of 2023 was the Spanish Grand Prix; that of 2026 is held in Madrid."""
    write_season(season_2026(), tmp_path, 2026)
    write_season(some_seasons().with_columns(event=_spain()), tmp_path, 2023)
    assert main(["calibrate", "--laps", str(tmp_path), "--seasons", "2023,2026", "--only", "2026", "--out", str(tmp_path / "out")]) == 0
    barcelona, madrid = (load_race(f"{name}-2026", tmp_path / "out") for name in ("barcelona", "spain"))
    assert barcelona.pit.loss_green_s.note.endswith("5 races, 2 here")
    assert madrid.pit.loss_green_s.note.endswith("5 races, 1 here")


def _spain() -> pl.Expr:
    return pl.col("event").replace({"Bahrain Grand Prix": "Spanish Grand Prix"})


def test_its_race_is_simulated_and_planned_with_all_its_cars(season: Path, records: dict[str, RaceRecord], capsys: Capture) -> None:
    race, record = str(season / "spain-2026.toml"), records["spain-2026"]
    last = record.cars[-1].driver
    assert record.scaling  # ranges of features come from simulated races
    assert main(["simulate", race, "--races", "64", "--json"]) == 0
    cars = json.loads(capsys.readouterr().out)["cars"]
    assert {car["driver"] for car in cars} == {car.driver for car in record.cars}
    assert all(len(car["positions"]) == CARS and sum(car["positions"]) == pytest.approx(1) for car in cars)
    assert sum(car["mean_position"] for car in cars) == pytest.approx(CARS * (CARS + 1) / 2)
    assert main(["plan", race, "--driver", last, "--races", "2000", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["driver"] == last


def test_a_field_beyond_what_a_file_may_hold_is_refused_and_nothing_written(tmp_path: Path, capsys: Capture) -> None:
    table = season_2026(1)
    more = [table.filter(pl.col("driver") == "NEW").with_columns(driver=pl.lit(f"X{i}X")) for i in range(3)]
    write_season(pl.concat([table, *more]), tmp_path, 2026)
    assert main(["calibrate", "--laps", str(tmp_path), "--seasons", "2026", "--out", str(tmp_path / "out")]) == 2
    assert "Barcelona Grand Prix 2026: 25 cars, and a race has 24 at most" in capsys.readouterr().err
    assert list((tmp_path / "out").iterdir()) == []
