"""What the study of generalisability makes of its cells: estimates, Table 3, differences, cars, the held-out season."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest

from rsrl.agents import ModelMetadata
from rsrl.errors import RsrlError
from rsrl.evaluation.gap import share_of_gap
from rsrl.evaluation.study import (
    Cell,
    Entrant,
    Study,
    default_strategists,
    generalise,
    make_entrants,
    plan_cells,
    plot_figure3,
    race_of_track,
    trained_races,
)
from rsrl.evaluation.study.estimates import comparable_mean, difference, over_tracks
from rsrl.results import LeftOut, Machine, Provenance, StudyResult
from rsrl.season import STUDY_TRACKS, group_races, load_race, study_races
from rsrl.statistics import Estimate, mean_interval
from rsrl.strategists import STRATEGISTS

PROVENANCE = Provenance(
    "rsrl study generalise", 7, "0.1.0", Machine("a processor", 2, "3.11.7", "Linux x86_64"), "2026-11-24T15:57:21+00:00"
)
Row = TypeVar("Row")
MODEL = Entrant("all", "bahrain-2023", True, ("japan-2022",), 4)
FIXED = Entrant("fixed", "fixed", False, (), 4)
HEURISTIC = Entrant("heuristic", "heuristic", False, (), 2)
STUDY = Study((MODEL, FIXED, HEURISTIC), ("japan-2023", "spain-2023"))


def result_of(positions: list[int], plan: str = "M-H@25", laps: int = 53) -> dict[str, Any]:
    common = {"plan": plan, "share": 1.0, "races": len(positions), "compounds": [1, 2], "laps": [25], "windows": [[25, 25]]}
    zeros = [0] * len(positions)
    return {
        "laps": laps, "position": positions, "points": zeros, "stops": [1] * len(positions), "invalid": zeros, "retired": zeros,
        "driven": [plan] * len(positions), "common": [common | {"mean_position": float(np.mean(positions))}],
        "timing": {"decision_ms": 0.5},
    }  # fmt: skip


def studied(study: Study, positions: Mapping[tuple[str, str], list[int] | None], by_car: Mapping[str, int] | None = None) -> StudyResult:
    """A study whose cells came out like this; None: left out."""
    cells = plan_cells(study)
    results: dict[Cell, dict[str, Any]] = {}
    for (name, race, driver), cell in cells.items():
        found = positions[name, race]
        shift = (by_car or {}).get(driver, 0) if name == "all" else 0
        results[cell] = {"left_out": "no plans"} if found is None else result_of([p + shift for p in found])
    return generalise(study, cells, results, PROVENANCE)


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return studied(
        STUDY,
        {
            ("all", "japan-2023"): [3, 5, 4, 8], ("fixed", "japan-2023"): [5, 5, 6, 8], ("heuristic", "japan-2023"): [2, 4],
            ("all", "spain-2023"): [2, 2, 3, 5], ("fixed", "spain-2023"): None, ("heuristic", "spain-2023"): [3, 3],
        },
    )  # fmt: skip


def row_of(rows: Sequence[Row], **wanted: object) -> Row:
    (row,) = [row for row in rows if all(getattr(row, name) == value for name, value in wanted.items())]
    return row


def test_table_of_mean_positions(result: StudyResult) -> None:
    row = row_of(result.tracks.table, strategist="all", race="japan-2023")
    assert (row.mean_position, row.own_mean_position, row.races) == (5.0, 5.0, 4)
    assert row.ci95 == mean_interval(np.array([3, 5, 4, 8]))
    assert (row.trained, row.best) == (True, False), "trained at the track, in another season"
    fewer = row_of(result.tracks.table, strategist="heuristic", race="japan-2023")
    # one place ahead on both common races, so one place ahead of the model's mean over all four
    assert (fewer.mean_position, fewer.own_mean_position, fewer.races, fewer.best) == (4.0, 3.0, 2, True)
    assert [r.code for r in result.tracks.races] == ["JPN", "SPN"]
    assert [r.unseen for r in result.tracks.races] == [False, True]
    assert {(r.strategist, r.race) for r in result.tracks.table} == {
        ("all", "japan-2023"), ("all", "spain-2023"), ("fixed", "japan-2023"), ("heuristic", "japan-2023"), ("heuristic", "spain-2023"),
    }  # fmt: skip


def test_averages_over_seen_and_unseen_tracks(result: StudyResult) -> None:
    def average(name: str, over: str) -> tuple[int, float]:
        row = row_of(result.tracks.averages, strategist=name, over=over)
        return row.tracks, row.mean_position

    assert average("all", "all") == (2, 4.0)
    assert average("all", "seen") == average("all", "trained") == (1, 5.0)
    assert average("all", "unseen") == average("all", "untrained") == (1, 3.0)
    assert average("fixed", "all") == (1, 6.0)
    # one ahead in Japan and one behind in Spain
    assert average("heuristic", "all") == (2, 4.0)
    row = row_of(result.tracks.averages, strategist="all", over="all")
    assert row.ci95 == mean_interval(np.array([2.5, 3.5, 3.5, 6.5])), "races of one number count once"


def test_differences_to_the_model(result: StudyResult) -> None:
    rows = result.tracks.differences
    assert {row.against for row in rows} == {"all"}
    japan = row_of(rows, strategist="fixed", race="japan-2023")
    assert (japan.difference, japan.p_ahead, japan.races) == (1.0, 0.75, 4)
    assert japan.ci95 == mean_interval(np.array([2, 0, 2, 0]))
    assert row_of(rows, strategist="heuristic", race="all").difference == 0.0
    assert row_of(rows, strategist="heuristic", race="all").p_ahead == 0.5
    assert row_of(rows, strategist="heuristic", race="unseen").p_ahead == 1.0
    assert not [row for row in rows if row.strategist == "fixed" and row.race == "spain-2023"]


def test_models_against_the_best_baseline_of_each_track(result: StudyResult) -> None:
    japan, spain = result.tracks.best_baselines
    assert (japan.baseline, japan.models[0].difference, japan.models[0].races) == ("heuristic", -1.0, 2)
    assert (spain.baseline, spain.models[0].difference, spain.models[0].p_ahead) == ("heuristic", 1.0, 1.0)


def test_who_was_left_out_is_told(result: StudyResult) -> None:
    assert result.left_out == (LeftOut("fixed", "spain-2023", "no plans"),)
    with pytest.raises(RsrlError, match="no strategist of the study can call any of its races"):
        studied(Study((FIXED,), ("japan-2023",)), {("fixed", "japan-2023"): None})


def test_criteria_name_their_references(result: StudyResult) -> None:
    rows = result.tracks.criteria
    assert row_of(rows, strategist="all", race="japan-2023").similar_to == ("fixed", "heuristic")
    assert row_of(rows, strategist="all", race="japan-2023").better_than == (), "2, 0, 2 and 0 places ahead may be chance"
    assert row_of(rows, strategist="all", race="spain-2023").better_than == ("heuristic",)
    assert row_of(rows, strategist="fixed", race="japan-2023").similar_to == ("heuristic",), "not to itself"
    assert row_of(rows, strategist="heuristic", race="spain-2023").reasonable is None, "nobody to compare with"


def test_every_car_called(monkeypatch: pytest.MonkeyPatch) -> None:
    study = replace(STUDY, entrants=(MODEL, HEURISTIC), races=("japan-2023",), cars_at=("japan-2023",), cars_by=("all", "heuristic"))
    positions = {("all", "japan-2023"): [10, 10, 10, 11], ("heuristic", "japan-2023"): [10, 10]}
    drivers = [car.driver for car in load_race("japan-2023").cars]
    result = studied(study, positions, {drivers[0]: -2, drivers[1]: -1, drivers[2]: 1})
    (row,) = result.cars
    assert (row.strategist, row.against, row.cars, row.ahead) == ("heuristic", "all", 20, 2)
    assert (row.surely_ahead, row.surely_behind) == (2, 1)
    assert row.difference == pytest.approx((2 + 1 - 1) / 20)
    car = row.by_car[0]
    assert (car.driver, car.mean_position, car.reference_mean_position, car.difference, car.p_ahead) == (drivers[0], 10, 8.25, 2, 1)


def test_the_held_out_season_has_a_table_of_its_own() -> None:
    study = Study((MODEL, HEURISTIC), ("japan-2023",), held_out=("japan-2024",))
    positions = {("all", r): [3, 4] for r in ("japan-2023", "japan-2024")} | {
        ("heuristic", r): [5, 5] for r in ("japan-2023", "japan-2024")
    }
    result = studied(study, positions)
    assert result.held_out is not None
    assert {row.race for row in result.held_out.table} == {"japan-2024"}
    assert {row.race for row in result.tracks.table} == {"japan-2023"}
    assert studied(replace(study, held_out=()), positions).held_out is None


def test_a_bound_is_neither_best_nor_a_baseline_but_ends_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STRATEGISTS, "hindsight", STRATEGISTS["heuristic"])
    study = Study((MODEL, FIXED, Entrant("hindsight", "hindsight", False, (), 4)), ("japan-2023",))
    result = studied(
        study,
        {("all", "japan-2023"): [3, 5, 4, 4], ("fixed", "japan-2023"): [5, 5, 6, 4], ("hindsight", "japan-2023"): [1, 3, 4, 4]},
    )
    assert row_of(result.tracks.table, strategist="all").best is True
    assert result.tracks.best_baselines[0].baseline == "fixed"
    assert [row.kind for row in result.strategists] == ["model", "baseline", "bound"]
    shares = {row.strategist: row.share for row in result.tracks.gap_closed if row.race == "all"}
    assert shares == {"all": pytest.approx(0.5), "fixed": 0, "hindsight": 1}


def test_figure_of_the_papers_tracks(result: StudyResult, tmp_path: Path) -> None:
    paths = plot_figure3(result.tracks, tmp_path)
    assert [path.name for path in paths] == ["strategies-japan-2023.png"], "Spain is none of them"
    assert paths[0].read_bytes().startswith(b"\x89PNG")


def test_a_mean_of_fewer_races_is_told_for_all_of_them() -> None:
    rng = np.random.default_rng(0)
    errors, covered, plain = [], [], []
    for _ in range(2000):
        luck = rng.normal(0, 3, 300)
        longest, own = luck + rng.normal(0, 1, 300), luck[:30] + rng.normal(1, 1, 30)
        mean, (low, high) = comparable_mean(own, longest)
        errors.append(mean - 1)
        covered.append(low <= 1 <= high)
        plain.append(own.mean() - 1)
    assert abs(np.mean(errors)) < 0.02
    assert 0.93 < np.mean(covered) < 0.97
    assert np.std(errors) < 0.6 * np.std(plain), "the luck in common is taken out"
    values = rng.normal(size=20)
    assert comparable_mean(values, values + 5) == (float(values.mean()), mean_interval(values))


def test_differences_are_over_the_races_in_common() -> None:
    d = difference([np.array([3.0, 4.0, 9.0])], [np.array([2.0, 4.0])])
    assert (d.difference, d.p_ahead, d.races) == (0.5, 0.75, 2)
    both = difference([np.array([3.0, 4.0]), np.array([1.0, 1.0])], [np.array([2.0, 4.0]), np.array([2.0, 2.0])])
    assert (both.difference, both.p_ahead) == (-0.25, 0.375)
    assert over_tracks([np.array([1.0, 2.0, 3.0]), np.array([3.0, 4.0])]).tolist() == [2, 3]


def test_share_of_a_gap_and_its_interval() -> None:
    worst, best = np.array([6.0, 8.0, 7.0, 7.0]), np.array([2.0, 4.0, 3.0, 3.0])
    assert share_of_gap([4.0, 6.0, 5.0, 5.0], worst, best) == Estimate(0.5, (0.5, 0.5))
    closed = share_of_gap([4.0, 6.0, 7.0, 3.0], worst, best)
    assert closed.value == 0.5
    assert closed.ci95 == pytest.approx(tuple(0.5 + np.array(mean_interval(np.array([0, 0, -2.0, 2.0]))) / 4))
    assert math.isnan(share_of_gap(worst, worst, worst).value)


def test_who_takes_part() -> None:
    model, fixed, heuristic = make_entrants({"m": "bahrain-2023"}, ["fixed", "heuristic"], 960, {"heuristic": 96})
    assert (model.is_model, model.trained_on, model.races) == (True, ("bahrain-2023",), 960)
    assert (fixed.is_baseline, fixed.races, heuristic.races) == (True, 960, 96)
    assert set(default_strategists()) <= set(STRATEGISTS)
    assert {"fixed", "heuristic", "imitation", "best-plan-sc"} <= set(default_strategists())


@pytest.mark.parametrize(
    ("models", "strategists", "races_of", "message"),
    [
        ({}, ["oracle"], {}, "unknown strategist 'oracle'; there are fixed"),
        ({"m": "nowhere"}, [], {}, "no model 'nowhere'"),
        ({"fixed": "bahrain-2023"}, [], {}, "a model cannot be called fixed"),
        ({}, [], {}, "nobody to study"),
        ({}, ["fixed"], {"planner": 96}, "races of 'planner': no such strategist takes part; there are fixed"),
    ],
)
def test_who_cannot_take_part_is_refused(models: dict[str, str], strategists: list[str], races_of: dict[str, int], message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        make_entrants(models, strategists, 10, races_of)


def test_what_a_model_trained_on() -> None:
    assert trained_races("x", ModelMetadata(race="japan-2023")) == ("japan-2023",)
    assert trained_races("x", ModelMetadata(race="rsrl-2")) == group_races("rsrl-2")
    assert trained_races("x", ModelMetadata(race="japan-2023, bahrain-2023")) == group_races("rsrl-2")
    assert trained_races("rsrl-9", ModelMetadata()) == group_races("rsrl-9"), "its name says it where its file does not"
    assert trained_races("x", ModelMetadata()) == ()


def test_a_race_of_a_track() -> None:
    assert [race_of_track(track) for track in STUDY_TRACKS] == list(study_races())
    assert race_of_track("spain-2024") == "spain-2024"
    with pytest.raises(RsrlError, match="unknown race 'atlantis-2023'"):
        race_of_track("atlantis")
