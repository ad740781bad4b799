"""The parts of a calibration, each on numbers whose answer is known."""

import csv
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from calibration_laps import known_record, simulated

from rsrl.calibration.design import Design, fit, robust_sd
from rsrl.calibration.facts import find_round, published_strategies, race_facts
from rsrl.calibration.incidents import deployments, fit_incidents
from rsrl.calibration.pit import fit_tail
from rsrl.calibration.rivals import race_plans, sets_used
from rsrl.calibration.stops import stop_table
from rsrl.errors import RsrlError
from rsrl.season import SC, VSC


def test_fit_of_one_column_without_outliers_is_the_mean() -> None:
    d = Design(5)
    d.add("mean", np.ones(5))
    found = fit(d, [1.0, 2.0, 3.0, 4.0, 5.0], np.arange(5))
    assert found.value("mean") == pytest.approx(3.0)
    assert found.combine({"mean": 2.0, "absent": 9.0})[0] == pytest.approx(6.0)


def test_prior_and_data_meet_by_their_precision() -> None:
    rng = np.random.default_rng(0)
    y = 1.0 + rng.normal(0, 1.0, 400)
    d = Design(400)
    d.add("mean", np.ones(400), mean=0.0, sd=0.05)  # as much precision as the 400 observations have
    found = fit(d, y, np.arange(400))
    assert found.value("mean") == pytest.approx(y.mean() / 2, abs=0.05)
    lone = Design(3)
    lone.add("mean", np.ones(3))
    lone.add("unseen", np.zeros(3), mean=0.7, sd=0.1)
    value, se = fit(lone, [1.0, 1.1, 0.9], np.arange(3)).combine({"unseen": 1.0})
    assert [value, se] == pytest.approx([0.7, 0.1])


def test_a_few_wild_laps_hardly_move_a_fit() -> None:
    rng = np.random.default_rng(1)
    y = rng.normal(10.0, 0.1, 200)
    y[:5] += 50.0
    d = Design(200)
    d.add("mean", np.ones(200))
    assert fit(d, y, np.arange(200)).value("mean") == pytest.approx(10.0, abs=0.05)


def test_standard_error_counts_clusters_not_rows() -> None:
    rng = np.random.default_rng(2)
    cars = np.repeat(np.arange(20), 50)
    y = rng.normal(0, 1.0, 20)[cars] + rng.normal(0, 0.01, 1000)
    d = Design(1000)
    d.add("mean", np.ones(1000))
    assert fit(d, y, cars).combine({"mean": 1.0})[1] == pytest.approx(1 / np.sqrt(20), rel=0.4)
    assert robust_sd([0.0, 1.0, 2.0, 3.0, 100.0]) == pytest.approx(1.4826)


def test_log_logistic_tail_comes_back() -> None:
    rng = np.random.default_rng(3)
    u = rng.uniform(size=(40, 25))
    times = 0.9 * (u / (1 - u)) ** (1 / 2.4)
    excess = times - times.min(axis=1, keepdims=True)
    scale, shape = fit_tail(excess.ravel(), np.full(excess.size, 25.0))
    assert scale.value == pytest.approx(0.9, abs=0.06)
    assert shape.value == pytest.approx(2.4, abs=0.2)
    assert scale.se < 0.1


def test_stops_are_measured_against_the_cars_that_stay_out() -> None:
    record = known_record()
    stops = stop_table(simulated(record, 3))
    assert stops.height > 60
    assert stops["loss_s"].median() == pytest.approx(record.pit.loss_green_s.value, abs=3.0)  # tyres and traffic come on top
    assert min(stops["lane_s"].drop_nulls()) > 25.0
    assert stops["gap_start_s"].null_count() < 5


def test_plans_are_what_the_cars_ran() -> None:
    record = known_record()
    table = simulated(record, 4, (2023,))
    facts = race_facts(table, None, 2023, 1)
    plans = race_plans(table, facts, 2023, 1)
    assert len(plans) == 20
    assert all(p.last_laps[-1] == record.laps and len(set(p.letters)) > 1 for p in plans)
    stopped = table.filter(pl.col("pit_in_s").is_not_null())
    assert sum(len(p.letters) - 1 for p in plans) == stopped.height
    assert sets_used(table, 2023, 1)["H"] == 2


def test_safety_cars_are_found_with_their_length() -> None:
    record = known_record(sc=0.03, vsc=0.03)
    table = simulated(record, 5)
    runs = deployments(table)
    slow = table.filter(pl.col("track_status") != "1").select("season", "round", "lap", "track_status").unique()
    assert runs.filter(pl.col("status") == SC).height >= 1
    assert runs.filter(pl.col("status") == VSC).height >= 1
    assert runs["slow_laps"].sum() == slow["lap"].len()
    found = fit_incidents(table, [(2023, 1)], 1.0)
    assert sum(found.sc_laps) == pytest.approx(1.0)
    assert sum(found.vsc_laps) == pytest.approx(1.0)
    assert found.sc_gap_s.value == pytest.approx(record.incidents.sc_gap_s.value, abs=0.15)
    ratio = known_record().track.base_lap_s.value * record.incidents.vsc_lap_factor.value
    green = float(table.filter(pl.col("track_status") == "1")["lap_time_s"].median())  # type: ignore[arg-type]
    assert found.vsc_lap_factor.value == pytest.approx(ratio / green, abs=0.03)


def strategy(text: str, first: tuple[str, str], second: tuple[str, str], note: str) -> dict[str, str]:
    windows = dict(zip(("stop1_from", "stop1_to", "stop2_from", "stop2_to"), (*first, *second), strict=True))
    return {"round": "1", "strategy": text} | windows | {"note": note}


def facts_folder(folder: Path, grid: dict[str, int], retired: str) -> Path:
    def write(name: str, rows: list[dict[str, str]]) -> None:
        with (folder / name).open("w", newline="") as handle:
            writer = csv.DictWriter(handle, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)

    write("ergast_races.csv", [{"raceId": "7", "year": "2023", "round": "1"}])
    write("ergast_drivers.csv", [{"driverId": code, "code": code} for code in grid])
    write("ergast_status.csv", [{"statusId": "1", "status": "Finished"}, {"statusId": "5", "status": "Engine"}])
    write(
        "ergast_results.csv",
        [{"raceId": "7", "driverId": d, "grid": str(g), "laps": "57", "statusId": "5" if d == retired else "1"} for d, g in grid.items()],
    )
    write(
        "published_strategies_2023.csv",
        [
            strategy("S-H-S", ("", ""), ("35", "41"), "first stint 'around 18 laps'"),
            strategy("M-H", ("20", "30"), ("", ""), ""),
            strategy("M-H-?-S", ("", ""), ("", ""), ""),
        ],
    )
    return folder


def test_grid_from_results_puts_the_pit_lane_last(tmp_path: Path) -> None:
    record = known_record()
    table = simulated(record, 6, (2023,))
    grid = {car.driver: car.grid for car in record.cars} | {"VER": 0}
    facts = race_facts(table, facts_folder(tmp_path, grid, "PER"), 2023, 1)
    assert facts.grid["VER"] == 20
    assert facts.grid["PER"] == 1
    assert facts.retired == {"PER"}
    assert published_strategies(tmp_path, 2023, 1, 57) == ("S-H@18-S@38", "M-H@25")
    with pytest.raises(RsrlError, match="no row with"):
        race_facts(table, tmp_path, 2022, 1)


def test_without_results_the_grid_is_lap_one_and_says_so() -> None:
    table = simulated(known_record(), 6, (2023,))
    facts = race_facts(table, None, 2023, 1)
    first = table.filter(pl.col("lap") == 1).sort("position")["driver"].to_list()
    assert sorted(facts.grid, key=facts.grid.__getitem__) == first
    assert "lap 1" in facts.source
    assert published_strategies(None, 2023, 1, 57) == ()


def test_unknown_race_lists_those_there_are() -> None:
    table = simulated(known_record(), 6, (2023,))
    assert find_round(table, "bahrain-2023") == (2023, 1, "Bahrain Grand Prix")
    with pytest.raises(RsrlError, match="'atlantis-2023' is not in the lap files; there are bahrain-2023"):
        find_round(table, "atlantis-2023")
