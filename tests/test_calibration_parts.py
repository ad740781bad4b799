"""The parts of a calibration, each on numbers whose answer is known."""

import csv
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest
from calibration_laps import known_record, simulated

from rsrl.calibration.compounds import hardness, lap_km
from rsrl.calibration.entry import completed, entry_from, nominated, sets_beyond, sets_used
from rsrl.calibration.history import read_history
from rsrl.calibration.pooling.car import _form_share
from rsrl.calibration.pooling.incident import _from_lap1, _with_retirements
from rsrl.calibration.race.design import Design, fit, robust_sd
from rsrl.calibration.race.incidents import Deployment, analyse_incidents
from rsrl.calibration.race.stops import stop_table
from rsrl.calibration.race_facts import published_strategies, race_facts, starters_only
from rsrl.calibration.rules import USUAL, following_aid, rules_of
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.observed import replay_script
from rsrl.laps import read_seasons, stints
from rsrl.season import SC, VSC, Figure


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


def test_stops_are_measured_against_the_cars_that_stay_out() -> None:
    record = known_record()
    stops = stop_table(simulated(record, 3))
    assert stops.height > 60
    assert stops["loss_s"].median() == pytest.approx(record.pit.loss_green_s.value, abs=3.0)  # tyres and traffic come on top
    assert min(stops["lane_s"].drop_nulls()) > 25.0
    assert stops["gap_start_s"].null_count() < 5


def test_sets_are_the_most_any_car_used() -> None:
    table = simulated(known_record(), 4, (2023,))
    assert sets_used(table)["H"] == 2


def test_safety_cars_are_found_with_their_length() -> None:
    table = simulated(known_record(sc=0.03, vsc=0.03), 5, (2022,))
    found = analyse_incidents(table)
    slow = table.filter(pl.col("track_status") != "1").select("lap", "track_status").unique()
    assert {d.status for d in found.deployments} <= {SC, VSC}
    assert sum(len(d.excess) for d in found.deployments) == slow.height > 0
    assert not any(d.red for d in found.deployments)
    assert found.laps == 57


def test_a_red_flag_is_a_safety_car_that_stopped_the_race() -> None:
    table = simulated(known_record(), 5, (2022,))
    red = table.with_columns(
        track_status=pl.when(pl.col("lap").is_between(20, 21)).then(pl.lit("45")).otherwise("track_status"),
        lap_time_s=pl.when(pl.col("lap").is_between(20, 21)).then(pl.col("lap_time_s") * 1.6).otherwise("lap_time_s"),
    )
    (found,) = analyse_incidents(red).deployments
    assert (found.lap, found.status, found.red) == (20, SC, True)


def test_ladder_of_compounds() -> None:
    assert [hardness(c, 2023) for c in ("C0", "C1", "C5")] == [0, 1, 5]
    assert hardness("C1", 2022) == 0, "the C1 of 2022 was called C0 in 2023"
    assert lap_km(44) == pytest.approx(7.0, abs=0.05)
    assert lap_km(78) == pytest.approx(3.35, abs=0.05)
    assert lap_km(28) == 7.0, "a race cut short"


def test_compounds_nobody_ran_come_from_the_nominations_else_from_their_neighbours(tmp_path: Path) -> None:
    race = simulated(known_record(), 6, (2023,)).filter(pl.col("compound") != "S")
    assert completed(nominated(race, None), 2023) == {"S": "C3", "M": "C2", "H": "C1"}
    (tmp_path / "compound_nominations.csv").write_text("season,round,hard,medium,soft,source\n2023,1,C1,C2,C5,x\n")
    assert nominated(race, tmp_path) == {"S": "C5", "M": "C2", "H": "C1"}


def test_entry_before_a_race_does_not_know_which_sets_will_be_used() -> None:
    table = simulated(known_record(), 6, (2023,))
    before, after = entry_from(table, None, 2023, 1), entry_from(table, None, 2023, 1, as_driven=True)
    assert before.sets == {"S": 4, "M": 2, "H": 2}
    assert after.sets == sets_used(table)
    assert (before.name, before.laps, before.wet, before.max_laps_per_set) == ("bahrain-2023", 57, False, 0)
    with pytest.raises(RsrlError, match="season 2023 round 7 is not in the lap files"):
        entry_from(table, None, 2023, 7)


def test_cars_that_fitted_more_sets_than_the_race_has_get_their_own() -> None:
    table = simulated(known_record(), 6, (2023,))
    driver, number = stints(table).filter(pl.col("compound") == "S").group_by("driver").len().sort("len", "driver").row(-1)
    assert number > 1
    enough, few = {"S": number, "M": 9, "H": 9}, {"S": number - 1, "M": 9, "H": 9}
    assert sets_beyond(table, enough) == {}
    assert sets_beyond(table, few)[driver] == {"S": (0,) * number, "M": (0,) * 9, "H": (0,) * 9}
    assert dict(entry_from(table, None, 2023, 1).car_sets) == {}, "before a race nobody knows"
    after = entry_from(table, None, 2023, 1, as_driven=True)
    assert dict(after.car_sets) == sets_beyond(table, after.sets)


@pytest.mark.real_data
def test_norris_had_the_sets_that_he_fitted_at_bahrain_2023(real_data: Path) -> None:
    entry = entry_from(read_seasons(real_data / "laps", (2023,)), real_data / "facts", 2023, 1, as_driven=True)
    assert entry.sets == {"S": 3, "M": 1, "H": 2}
    assert entry.car_sets == {"NOR": {"S": (0, 0, 0, 0), "M": (0,), "H": (0, 0)}}


@pytest.mark.real_data
def test_history_ends_before_the_race_concerned(real_data: Path) -> None:
    past = read_history(real_data / "facts", (2023, 15))
    assert max((p.season, p.round) for p in past) == (2023, 14)
    singapore = {p.season: len(p.safety_cars) for p in past if p.circuit == "marina_bay"}
    assert singapore[2019] == 3
    assert set(range(2010, 2020)) <= set(singapore)
    bahrain = [p for p in past if p.circuit == "bahrain"]
    assert sum(len(p.safety_cars) for p in bahrain) < sum(singapore.values())


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
        [
            {"raceId": "7", "driverId": d, "constructorId": "1", "grid": str(g), "laps": "57", "statusId": "5" if d == retired else "1"}
            | {"positionOrder": str(i), "positionText": "R" if d == retired else str(i)}
            for i, (d, g) in enumerate(grid.items(), 1)
        ],
    )
    write("ergast_constructors.csv", [{"constructorId": "1", "name": "Some Team"}])
    write("ergast_qualifying.csv", [{"raceId": "7", "driverId": "VER", "q1": "1:30.500", "q2": "1:29.75", "q3": ""}])
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
    assert facts.quali_s == {"VER": 89.75}
    assert published_strategies(tmp_path, 2023, 1, 57) == ("S-H@18-S@38", "M-H@25")
    with pytest.raises(RsrlError, match="no row with"):
        race_facts(table, tmp_path, 2022, 1)


def test_a_disqualified_car_saw_the_flag_whatever_the_reason_and_the_laps_in_the_results(tmp_path: Path) -> None:
    record = known_record()
    late, early = record.cars[3].driver, record.cars[5].driver
    table = simulated(record, 6, (2023,)).filter((pl.col("driver") != early) | (pl.col("lap") <= 20))
    facts_folder(tmp_path, {car.driver: car.grid for car in record.cars}, "PER")
    results = pl.read_csv(tmp_path / "ergast_results.csv", infer_schema=False)
    out = pl.col("driverId").is_in([late, early])
    statuses = pl.read_csv(tmp_path / "ergast_status.csv", infer_schema=False)
    pl.concat([statuses, pl.DataFrame({"statusId": ["9"], "status": ["Underweight"]})]).write_csv(tmp_path / "ergast_status.csv")
    changed = {"positionText": "D", "statusId": "9", "laps": "0"}
    results.with_columns(**{c: pl.when(out).then(pl.lit(v)).otherwise(c) for c, v in changed.items()}).write_csv(
        tmp_path / "ergast_results.csv"
    )
    facts = race_facts(table, tmp_path, 2023, 1)
    assert facts.disqualified == {late, early}
    assert facts.retired == {"PER", early}  # black flag on lap 21
    assert (facts.laps_done[late], facts.laps_done[early]) == (57, 20)
    assert not facts.classified & {late, early}
    script = replay_script(table, facts)
    assert {list(facts.grid)[i] for i in script.disqualified} == {late, early}
    assert {list(facts.grid)[i]: lap for i, lap in script.retire.items()}[early] == 21


def deployment(lap: int, status: int, laps: int = 3) -> Deployment:
    return Deployment(lap, status, (0.5,) * laps, False)


def test_safety_cars_that_came_with_a_retirement_are_counted() -> None:
    """Two cars share the safety car of lap 21, that of lap 22 stops behind it, that of lap 30 brings out nothing."""
    retired = tuple((f"D{lap}", lap - 1) for lap in (1, 10, 20, 21, 22, 30, 41, 58))  # the last one saw the flag
    deployments = tuple(deployment(*d) for d in ((1, SC), (10, VSC), (21, SC), (35, SC), (42, VSC)))
    analysis: Any = SimpleNamespace(retired=retired, entry=SimpleNamespace(laps=57, circuit="here"))
    incidents: Any = SimpleNamespace(deployments=deployments)
    assert _with_retirements([(analysis, incidents)], SC) == {"here": (1.0, 5.0)}
    assert _with_retirements([(analysis, incidents)], VSC) == {"here": (2.0, 5.0)}
    assert _from_lap1([(analysis, incidents)]) == {"here": (1.0, 1.0)}


def races_with_form(share: float, races: int) -> list[Any]:
    """Races of ten teams whose cars' form has the variance 0.06 s squared, `share` of it the team's, and an error of 0.126 s each."""
    rng = np.random.default_rng(3)
    starters = tuple((f"D{car}", f"T{car // 2}", car + 1) for car in range(20))
    found = []
    for number in range(races):
        team, own = rng.normal(0, np.sqrt(0.06 * share), 10), rng.normal(0, np.sqrt(0.06 * (1 - share)), 20)
        seen = 0.1 * np.arange(20) + np.repeat(team, 2) + own + rng.normal(0, 0.126, 20)
        cars = {f"D{i}": Figure(float(seen[i]), 0.2, 40) for i in range(20)}
        pace = SimpleNamespace(cars=cars, base_lap_s=Figure(90.0, 0.1, 900))
        found.append(SimpleNamespace(pace=pace, entry=SimpleNamespace(season=2030, round=number, starters=starters)))
    return found


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_the_share_of_form_that_team_mates_have_in_common_comes_back(share: float) -> None:
    found = _form_share(races_with_form(share, 40))
    assert abs(found.value - (400 * share + 60 * 0.75) / 460) < 0.1
    assert found.n == 400
    few = _form_share(races_with_form(share, 1))
    assert (few.value, few.n) == (0.75, 0)


def test_a_driver_who_withdrew_is_no_starter_though_he_has_a_lap_and_one_who_crashed_on_lap_1_is(tmp_path: Path) -> None:
    record = known_record()
    ghosts = pl.col("driver").is_in(["VER", "PER"]) & (pl.col("lap") > 1)
    table = simulated(record, 6, (2023,)).filter(~ghosts)
    facts_folder(tmp_path, {car.driver: car.grid for car in record.cars}, "PER")
    results = pl.read_csv(tmp_path / "ergast_results.csv", infer_schema=False)
    withdrew = pl.when(pl.col("driverId") == "VER").then(pl.lit("W")).otherwise("positionText")
    results.with_columns(positionText=withdrew).write_csv(tmp_path / "ergast_results.csv")
    facts = race_facts(table, tmp_path, 2023, 1)
    assert set(facts.grid) == {car.driver for car in record.cars} - {"VER"}
    assert sorted(facts.grid.values()) == list(range(1, 20))
    assert set(starters_only(table, facts)["driver"]) == set(facts.grid)
    entry = entry_from(table, tmp_path, 2023, 1)
    assert [driver for driver, _, _ in entry.starters] == sorted(facts.grid, key=facts.grid.__getitem__)


def test_rules_of_races_are_data() -> None:
    assert (rules_of(2025, "monaco").min_sets, rules_of(2025, "qatar").max_laps_per_set) == (3, 25)
    assert (rules_of(2024, "monaco"), rules_of(2024, "qatar")) == (USUAL, USUAL)
    assert [following_aid(season) for season in (2010, 2011, 2025, 2026)] == ["none", "drs", "drs", "overtake"]
    table = simulated(known_record(), 6, (2023,)).with_columns(season=pl.lit(2025, pl.Int64), event=pl.lit("Monaco Grand Prix"))
    entry = entry_from(table, None, 2025, 1)
    assert (entry.min_sets, entry.max_laps_per_set, entry.circuit) == (3, 0, "monaco")


@pytest.mark.parametrize(
    ("event", "season", "c_numbers"),
    [
        ("Austrian Grand Prix", 2021, {"S": "C5", "M": "C4", "H": "C3"}),
        ("Styrian Grand Prix", 2021, {"S": "C4", "M": "C3", "H": "C2"}),
        ("Qatar Grand Prix", 2021, {"S": "C3", "M": "C2", "H": "C1"}),
        ("Austrian Grand Prix", 2018, {}),
    ],
)
def test_nominations_of_2021_are_known(event: str, season: int, c_numbers: dict[str, str]) -> None:
    table = simulated(known_record(), 6, (2023,))
    bare = table.with_columns(season=pl.lit(season, pl.Int64), event=pl.lit(event), compound_c=pl.lit(None, pl.String))
    assert nominated(bare, None) == c_numbers


def test_a_c_number_that_is_not_known_is_a_step_from_its_neighbour() -> None:
    assert completed({"M": "C5", "H": "C4"}, 2025)["S"] == "C6"
    assert completed({"M": "C5", "H": "C4"}, 2026)["S"] == "C5", "there is no C6 then"
    assert completed({"S": "C2"}, 2023) == {"S": "C2", "M": "C1", "H": "C0"}
    assert completed({}, 2026) == {"S": "C4", "M": "C3", "H": "C2"}


def test_without_results_the_grid_is_lap_one_and_says_so() -> None:
    table = simulated(known_record(), 6, (2023,))
    facts = race_facts(table, None, 2023, 1)
    first = table.filter(pl.col("lap") == 1).sort("position")["driver"].to_list()
    assert sorted(facts.grid, key=facts.grid.__getitem__) == first
    assert "lap 1" in facts.source
    assert published_strategies(None, 2023, 1, 57) == ()
