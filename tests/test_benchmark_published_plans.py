"""`rsrl plan` beside published strategies and the top ten: what counts as agreement, and the whole script."""

import dataclasses
import json
import sys
from pathlib import Path

import pytest
from docs_pages import benchmark
from made_up_field import FACTS, chose, medium_hard, race_of
from season_file_runs import words, written

from rsrl.cli.app import main
from rsrl.evaluation.backtest.published_plans import agreement, published_race, sequences, top_ten
from rsrl.results import PublishedResult, read_result
from rsrl.simulator import Plan

RACES = 1500


def test_the_top_ten_are_those_of_the_result_with_tyres_on_record() -> None:
    choices = chose(*["M-H@11"] * 10, "S-H@9", "H-M@20")
    unknown = dataclasses.replace(choices.cars[0], compounds=(-1, 2))
    race = race_of(medium_hard(), dataclasses.replace(choices, cars=(unknown, *choices.cars[1:])))
    order = ["C10", "C00", *(f"C{i:02d}" for i in range(1, 10)), "C11"]
    facts = dataclasses.replace(FACTS, positions={driver: i + 1 for i, driver in enumerate(order)})
    ran = top_ten(race._replace(facts=facts))
    assert [c.driver for c in ran] == ["C10", *(f"C{i:02d}" for i in range(1, 9))]  # C00 came second, on unknown tyres


def test_sequences_are_told_by_cars_with_median_stops_and_those_behind_a_safety_car() -> None:
    cars = [*chose("M-H@10", "S-H@9", "M-H@20").cars, *chose("M-H@13", green=False).cars]
    first, second = sequences(cars)
    assert (first.sequence, first.cars, first.stop_laps, first.slow_stops) == ("M-H", 3, (13,), 1)
    assert (second.sequence, second.cars, second.slow_stops) == ("S-H", 1, 0)


def test_agreement_is_part_by_part() -> None:
    ran = chose("M-H@10", "S-H@9", "M-H@20", "H-M@14").cars
    assert agreement(Plan.parse("M-H@15"), "plan", ran) == {"plan_start": 1, "plan_compounds": 1, "plan_sequence": 1, "plan_stops": 1}
    turned = agreement(Plan.parse("H-M@15"), "plan", ran)
    assert turned == {"plan_start": 0, "plan_compounds": 1, "plan_sequence": 0, "plan_stops": 1}
    assert all(value != value for value in agreement(Plan.parse("M-H@15"), "plan", ()).values())  # NaN


def test_the_plan_is_that_of_rsrl_plan(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    race = written(tmp_path)[0]
    path = tmp_path / "files" / f"{race.record.name}.toml"
    assert main(["plan", str(path), "--races", str(RACES), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    found = published_race(race_of(race.record, chose(*["M-H@20"] * 12)), RACES, 40, 0)
    assert found.driver == said["driver"]
    assert [found.best, found.next_best] == [plan["plan"] for plan in said["plans"][:2]]
    assert [list(window) for window in found.windows] == [stop["window"] for stop in said["plans"][0]["stops"]]
    assert found.p_best == pytest.approx(said["plans"][0]["p_best"])


def test_the_script_tells_every_race_with_published_strategies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    races = written(tmp_path)
    script = benchmark("published_plans")
    monkeypatch.setattr(sys, "argv", words(tmp_path, "published_plans"))
    parser = script.options_of(script.SCRIPT, script.__doc__, RACES)
    assert script.run(script.SCRIPT, parser, script.measure, script.published_tables) == 0
    found = read_result(tmp_path / "published_plans.json", PublishedResult, "published_plans.py")
    assert [r.race for r in found.races] == [r.record.name for r in races]
    assert all(r.published for r in found.races)
    assert 0 <= found.overall["plan_start"].mean <= 1
    printed = capsys.readouterr().out
    assert all(r.best in printed for r in found.races)
