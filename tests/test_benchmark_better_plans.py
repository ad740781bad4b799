"""Where a season file says that another sequence would have been better: on a race with a plain best plan, sure or unsure of its tyres."""

import dataclasses
import sys
from pathlib import Path

import pytest
from docs_pages import benchmark
from made_up_field import chose, medium_hard, race_of
from season_file_runs import words, written

from rsrl.evaluation.backtest.better_plans import FRESH, STOPS, TRAFFIC, WEAR, better_plan, parts_s
from rsrl.results import BetterPlan, BetterPlansResult, read_result
from rsrl.season import RaceRecord
from rsrl.simulator import Plan
from rsrl.strategists import CleanAir

RACES, DRAWS = 24, 6


def compare(record: RaceRecord, *plans: str) -> BetterPlan:
    found = better_plan(race_of(record, chose(*plans)), RACES, 0, DRAWS)
    assert isinstance(found, BetterPlan)
    return found


def test_a_field_on_softs_would_have_been_better_without_and_the_reason_is_wear() -> None:
    found = compare(medium_hard(), *["S-M@5-H@20"] * 8)
    assert found.clear
    assert sorted(Plan.parse(found.better).compounds) == [1, 2]
    assert found.gain_s > 10
    assert found.gain_s_ci95 == pytest.approx((found.gain_s, found.gain_s), abs=2.0)  # figures without errors
    assert sum(found.parts_s.values()) == pytest.approx(found.gain_s)
    assert found.parts_s[STOPS] == pytest.approx(20.0, abs=3.0)
    assert "1 stop fewer" in found.why
    assert found.driver == "C03"  # in the middle of eight


def test_a_field_on_the_best_sequence_could_not_have_done_better() -> None:
    record = medium_hard()
    best = compare(record, *["S-M@5-H@20"] * 8).better
    assert not compare(record, *[best] * 8).clear


def test_a_file_unsure_of_its_tyres_is_sure_of_no_plan() -> None:
    record = medium_hard()
    unsure = {
        c: dataclasses.replace(t, offset_s=t.offset_s._replace(se=0.8), wear_s_per_lap=t.wear_s_per_lap._replace(se=0.05))
        for c, t in record.tyres.items()
    }
    field = ["H-M@18"] * 8
    sure, not_sure = compare(record, *field), compare(dataclasses.replace(record, tyres=unsure), *field)
    assert not_sure.gain_s == sure.gain_s
    width = [high - low for low, high in (sure.gain_s_ci95, not_sure.gain_s_ci95)]  # type: ignore[operator]
    assert width[1] > width[0] + 5.0
    assert not not_sure.clear


def test_parts_sum_to_the_gain_and_are_those_of_an_empty_track() -> None:
    record = medium_hard()
    plan, base = Plan.parse("M-H@10"), Plan.parse("S-H@6-M@20")
    parts = parts_s(record, 2, plan, base, 30.0)
    clean_air = CleanAir(record, 2)
    assert parts[FRESH] == pytest.approx((6 * 1.5 + 14 * 0.2) - 20 * 0.2)
    assert parts[STOPS] + parts[FRESH] + parts[WEAR] == pytest.approx(clean_air.time_s(base) - clean_air.time_s(plan))
    assert sum(parts.values()) == pytest.approx(30.0)
    assert set(parts) == {STOPS, FRESH, WEAR, TRAFFIC}


def test_a_race_that_cannot_be_asked_about_says_why() -> None:
    record = medium_hard()
    few = better_plan(race_of(record, chose(*["M-H@9"] * 4)), 8, 0, 2)
    assert few == "few cars ran a plan of their own"
    sets = {c: dataclasses.replace(t, sets=1 if c == "H" else 3) for c, t in record.tyres.items()}
    lacking = better_plan(race_of(dataclasses.replace(record, tyres=sets), chose(*["M-H@9-H@20"] * 8)), 8, 0, 2)
    assert lacking == "the file gives C03 too few sets for M-H-H"


def test_the_script_asks_about_every_race(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    races = written(tmp_path)
    script = benchmark("better_plans")
    monkeypatch.setattr(script, "DRAWS", 4)
    monkeypatch.setattr(sys, "argv", words(tmp_path, "better_plans"))
    parser = script.options_of(script.SCRIPT, script.__doc__, 16)
    assert script.run(script.SCRIPT, parser, script.measure, script.better_plans) == 0
    found = read_result(tmp_path / "better_plans.json", BetterPlansResult, "better_plans.py")
    assert {r.race for r in found.races} | set(found.left_out) == {r.record.name for r in races}
    clear = [r for r in found.races if r.clear]
    assert f"| {len(clear)} of {len(found.races)} races |" in capsys.readouterr().out
