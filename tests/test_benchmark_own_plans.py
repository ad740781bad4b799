"""The best plans of a race by its own file, beside its field's: by hand on a race with a plain best plan, and the whole script."""

import dataclasses
import sys
from pathlib import Path

import pytest
from docs_pages import benchmark
from made_up_field import chose, medium_hard, race_of
from season_file_runs import words, written
from synthetic_race import figure, synthetic_race

from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.field_choice import field_choice
from rsrl.evaluation.backtest.over_races import over_races
from rsrl.evaluation.backtest.own_race import MEASURES, MEDIANS, OF_EVERY_RACE, own_race
from rsrl.evaluation.backtest.tyre_order import dominations
from rsrl.results import OwnPlansResult, read_result
from rsrl.season import RaceRecord
from rsrl.simulator import Plan

S, M, H = range(3)


@pytest.fixture(scope="module")
def quiet() -> RaceRecord:
    return medium_hard()


def test_the_commonest_choices_of_a_field() -> None:
    field = field_choice(chose("S-M@9", "M-H@11", "H-M@15", "M-H@13", "M-H@8-H@20", "S-M@9", "M-H@12"))
    assert (field.start, field.starts) == (M, (4, 7))
    assert field.sequence == (M, H)
    assert field.compounds == (M, H)  # H-M is among them
    assert field.stops == 1
    assert field.first_stop == 12.0
    assert [c.grid for c in field.three_cars()] == [2, 4, 7]
    assert not field.few


def test_of_equally_common_choices_that_of_the_car_further_forward_counts() -> None:
    assert field_choice(chose("H-M@15", "M-H@11", "M-H@13", "H-M@14")).sequence == (H, M)


def test_answers_to_a_safety_car_are_nobodys_own_plan() -> None:
    field = field_choice(chose(*["M-H@4"] * 6, green=False))
    assert (field.start, field.sequence, field.few) == (M, None, True)
    assert len(field.three_cars()) == 3


def test_a_field_that_ran_the_best_sequence_loses_nothing(quiet: RaceRecord) -> None:
    clean_air_best = own_race(race_of(quiet, chose(*["M-H@11"] * 8)), 24, 0).clean_air_best
    sequence = Plan.parse(clean_air_best)
    found = own_race(race_of(quiet, chose(*[str(sequence)] * 8)), 24, 0)
    assert sorted(sequence.compounds) == [M, H]
    assert [found.scores[f"clean_air_{name}"] for name in ("start_match", "sequence_match", "stops_match", "regret_s")] == [1, 1, 1, 0]
    assert found.scores["compounds_match"] == 1.0
    assert found.scores["regret_places"] == pytest.approx(0.0, abs=0.2)
    assert found.scores["behind_quickest_s"] == pytest.approx(0.0, abs=0.5)
    assert found.scores["first_stop_error_laps"] <= 4  # type: ignore[operator]
    assert (found.apart, found.ran_cars, found.own_cars, len(found.cars)) == (None, 8, 8, 3)


def test_a_field_on_softs_gives_seconds_away(quiet: RaceRecord) -> None:
    found = own_race(race_of(quiet, chose(*["S-M@5-H@20"] * 8)), 24, 0)
    assert found.ran == "S-M-H"
    assert [found.scores[name] for name in ("start_match", "compounds_match", "stops_match")] == [0, 0, 0]
    assert found.scores["regret_s"] > 10  # type: ignore[operator]
    assert found.scores["behind_quickest_s"] >= found.scores["regret_s"] - 0.5  # type: ignore[operator]
    for car in found.cars:
        assert car.commonest is not None
        assert Plan.parse(car.commonest).compounds == (S, M, H)


def test_a_race_with_few_own_plans_counts_for_what_needs_none(quiet: RaceRecord) -> None:
    found = own_race(race_of(quiet, chose(*["M-H@4"] * 6, green=False)), 8, 0)
    assert found.apart == "few cars"
    overall = over_races([found.scores], MEDIANS)
    assert set(overall) == set(OF_EVERY_RACE)
    with pytest.raises(RsrlError, match="no car of its season file finished"):
        own_race(race_of(quiet, chose()), 8, 0)


def test_means_and_medians_are_over_the_races_that_have_them() -> None:
    races: list[dict[str, float | None]] = [{"share": 1.0, "regret": 0.0, "none": None}, {"share": 0.0, "regret": 1.0, "none": None}]
    found = over_races([*races, {"share": None, "regret": 9.0, "none": float("nan")}], ["regret"])
    assert {name: m.mean for name, m in found.items()} == {"share": 0.5, "regret": 1.0}
    assert (found["regret"].low, found["regret"].high) == (0.0, 9.0)


def test_a_compound_dominates_another_or_the_file_has_an_order() -> None:
    def race(soft: tuple[float, float], hard: tuple[float, float]) -> list[tuple[str, str]]:
        tyres = {"S": (*soft, 0.0, 0.0), "M": (0.0, 0.06, 0.0, 0.0), "H": (*hard, 0.0, 0.0)}
        return [(d.better, d.worse) for d in dominations(synthetic_race(tyres=tyres))]

    assert race((-0.3, 0.1), (0.3, 0.03)) == []
    assert race((-0.3, 0.05), (0.3, 0.03)) == [("S", "M")]  # quicker and lasts longer
    assert race((-0.3, 0.1), (-0.1, 0.03)) == [("H", "M")]
    assert race((-0.3, 0.02), (0.3, 0.03)) == [("S", "M"), ("S", "H")]
    assert race((-0.3, 0.06), (0.3, 0.03)) == [("S", "M")]  # wears no more
    assert race((0.0, 0.01), (0.0, 0.01)) == []  # as quick


def test_what_a_file_says_of_two_compounds_is_told_once_each() -> None:
    record = synthetic_race()
    tyres = {c: dataclasses.replace(t, offset_s=figure(0.0)._replace(note="one source")) for c, t in record.tyres.items()}
    tyres["S"] = dataclasses.replace(tyres["S"], offset_s=figure(-1.0), wear_s_per_lap=figure(0.01)._replace(n=7, note="few laps"))
    found = next(dominations(dataclasses.replace(record, tyres=tyres)))
    assert found.reason.count("one source") == 1
    assert "few laps" in found.reason
    assert "0.010 s a lap from 7 laps" in found.reason


def test_the_script_writes_every_race_and_prints_its_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    races = written(tmp_path)
    script = benchmark("own_race_plans")
    monkeypatch.setattr(sys, "argv", words(tmp_path, "own_race_plans"))
    parser = script.options_of(script.SCRIPT, script.__doc__, 16)
    assert script.run(script.SCRIPT, parser, script.measure, script.own_plans_tables) == 0
    found = read_result(tmp_path / "own_race_plans.json", OwnPlansResult, "own_race_plans.py")
    assert [r.race for r in found.races] == [r.record.name for r in races]
    assert set(found.overall) <= set(MEASURES)
    for measure in found.overall.values():
        assert measure.low <= measure.mean <= measure.high
    printed = capsys.readouterr().out
    assert printed.count("\n|---|") == 3
    assert all(r.record.name in printed for r in races)
