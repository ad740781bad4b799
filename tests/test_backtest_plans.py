"""`rsrl backtest --mode plans`: scores of plans, the ranking of plans in a race with a known best one, and the command."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from invented_seasons import FIT, TEST, invented_races, write_files
from synthetic_race import figure, synthetic_race

from rsrl.calibration.choices import SEQUENCE_INDEX
from rsrl.cli.app import main
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest import check_request
from rsrl.evaluation.backtest.plan_ranking import CarPlans, rank_plans
from rsrl.evaluation.backtest.plan_scores import MEASURES, CarScores, logloss_lead, overall, summary
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, compile_figures

S, M, H = range(3)


def scores(ran: tuple[int, ...], predicted: tuple[int, ...] | None, **measures: float) -> dict[str, float]:
    car = CarScores.of(SEQUENCE_INDEX[ran], None if predicted is None else SEQUENCE_INDEX[predicted], **measures)
    return dict(zip(MEASURES, car.values.tolist(), strict=True))


def test_what_agrees_with_the_plan_that_was_run() -> None:
    same = scores((M, H), (M, H))
    assert [same[k] for k in MEASURES[:4]] == [1, 1, 1, 1]
    turned = scores((M, H), (H, M))
    assert [turned[k] for k in MEASURES[:4]] == [0, 1, 0, 1]
    longer = scores((M, H), (M, H, H))
    assert [longer[k] for k in MEASURES[:4]] == [1, 0, 0, 0]
    assert np.isnan(scores((M, H), None)["start_match"])


def test_the_error_of_the_first_stop_has_a_sign() -> None:
    early = scores((M, H), (M, H), first_stop_off_laps=-4.0)
    assert (early["first_stop_error_laps"], early["first_stop_bias_laps"]) == (4.0, -4.0)


def test_means_medians_and_intervals() -> None:
    def car(match: bool, regret: float) -> CarScores:
        return CarScores.of(SEQUENCE_INDEX[M, H], SEQUENCE_INDEX[(M, H) if match else (H, M)], regret_places=regret, choice_logloss=regret)

    races = [[car(True, 0.0), car(True, 0.1), car(False, 9.0)], [car(False, 0.2)]]
    found = overall(races)
    assert (found.races, found.cars) == (2, 4)
    assert found.start_match == 0.5
    assert found.regret_places == pytest.approx(0.15)  # the median
    assert found.choice_logloss == pytest.approx(9.3 / 4)
    assert found.first_stop_error_laps is None or np.isnan(found.first_stop_error_laps)
    assert "first_stop_error_laps" not in found.intervals
    low, high = found.intervals["start_match"].low, found.intervals["start_match"].high
    assert 0.0 <= low <= 0.5 <= high <= 1.0
    assert summary(races[0])["start_match"] == pytest.approx(2 / 3)
    lead = logloss_lead(races, [[car(True, r + 1.0) for r in (0.0, 0.1, 9.0)], [car(True, 1.2)]])
    assert lead is not None
    assert (lead.mean, lead.low, lead.high) == pytest.approx((-1.0, -1.0, -1.0))


@pytest.fixture(scope="module")
def quiet() -> RaceRecord:
    """Medium and hard are best by far: softs are slow and wear fast, a stop costs much, nothing is random but the rivals' plans."""
    tyres = {"S": (1.5, 0.5, 0.0, 0.0), "M": (0.0, 0.06, 0.0, 0.0), "H": (0.2, 0.02, 0.0, 0.0)}
    record = synthetic_race(laps=30, cars=4, tyres=tyres, sc_lap1=0.0, sc_per_lap=0.0, vsc_per_lap=0.0, lap_noise_sd_s=0.01)
    cars = tuple(dataclasses.replace(c, retire_per_lap=figure(0.0), retire_lap1=figure(0.0)) for c in record.cars)
    return dataclasses.replace(record, cars=cars)


def test_the_best_plan_of_a_quiet_race_is_found_and_regret_is_against_it(quiet: RaceRecord) -> None:
    plans = CarPlans(quiet, 1)
    figures = compile_figures(quiet)
    good = rank_plans(quiet, figures, 1, plans, Plan((M, H), (11,)), 0, 24)
    bad = rank_plans(quiet, figures, 1, plans, Plan((S, M, H), (15, 16)), 0, 24)
    assert sorted(good.best.compounds) == [M, H]
    assert good.best == bad.best
    assert bad.regret_s > good.regret_s + 5.0
    assert bad.regret_places >= good.regret_places
    assert good.own_sequence_first_stop == pytest.approx(min(plans.by_sequence[M, H][1]), abs=4)


def test_a_sequence_beyond_the_sets_has_no_first_stop(quiet: RaceRecord) -> None:
    ranking = rank_plans(quiet, compile_figures(quiet), 1, CarPlans(quiet, 1), Plan((S, S, S, M), (4, 8, 12)), 0, 8)
    assert np.isnan(ranking.own_sequence_first_stop)


def test_parts_cannot_be_taken_out_of_plans() -> None:
    with pytest.raises(RsrlError, match="--without takes part in forecast, replay and hindsight only"):
        check_request("plans", (2022,), 2023, 10, "traffic")


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder: Path = tmp_path_factory.mktemp("plans")
    write_files(invented_races(), folder)
    words = ["backtest", "--laps", str(folder / "laps"), "--facts", str(folder / "facts"), "--mode", "plans", "--races", "8"]
    assert main([*words, "--fit", ",".join(map(str, FIT)), "--test", str(TEST), "--out", str(folder / "plans.json")]) == 0
    found: dict[str, Any] = json.loads((folder / "plans.json").read_text(encoding="utf-8"))
    return found


def test_the_command_scores_every_car_whose_plan_was_its_own(result: dict[str, Any]) -> None:
    assert result["mode"] == "plans"
    scored = [r for r in result["races"] if r.get("apart") is None]
    assert scored
    assert result["overall"]["races"] == len(scored)
    assert result["overall"]["cars"] == sum(len(r["cars"]) for r in scored)
    assert set(result["overall"]["intervals"]) <= set(MEASURES)
    for predictor in (result["overall"], *result["baselines"].values()):
        for name in MEASURES[:4]:
            assert predictor[name] is None or 0 <= predictor[name] <= 1
    for race in scored:
        for car in race["cars"]:
            assert 0 < car["p_ran"] <= 1
            assert "@" in car["ran"]
            assert "@" in car["best"]


def test_given_the_others_a_choice_is_no_harder_to_tell(result: dict[str, Any]) -> None:
    overall = result["overall"]
    assert overall["choice_logloss_given_others"] < overall["choice_logloss"] + 0.3
    assert overall["choice_logloss"] < np.log(len(SEQUENCE_INDEX))
