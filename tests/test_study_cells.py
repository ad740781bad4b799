"""Cells of a study: what they give, what their keys depend on, and how they are kept."""

import dataclasses
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_architecture import SOURCE, imported_packages

from rsrl.errors import RsrlError
from rsrl.evaluation import run_races
from rsrl.evaluation.study import Cell, Store, make_cell, run_cell
from rsrl.evaluation.study.cells import code_files
from rsrl.season import RaceRecord, find_car, load_race, shipped_folder
from rsrl.simulator import Plan
from rsrl.strategists import find_model, make_strategist

RACE = "bahrain-2023"


def cell_of(strategist: str = "heuristic", race: str = RACE, *, races: int = 30, **options: str) -> Cell:
    return make_cell(strategist, race, None, seed=7, races=races, options=options)


def test_a_cell_gives_what_was_driven_race_by_race(bahrain: RaceRecord) -> None:
    result = run_cell(cell_of())
    car = find_car(bahrain, None)
    log = run_races(make_strategist("heuristic", bahrain, car), bahrain, car, 7, 30)
    assert result["position"] == log.position.tolist()
    assert result["points"] == log.points.tolist()
    assert result["retired"] == log.retired.astype(int).tolist()
    assert result["invalid"] == [0] * 30
    assert result["laps"] == 57
    for text, stops in zip(result["driven"], result["stops"], strict=True):
        assert Plan.parse(text).stops == stops
    assert result["common"][0]["plan"] == str(Plan(tuple(result["common"][0]["compounds"]), tuple(result["common"][0]["laps"])))
    assert result["timing"]["decision_ms"] > 0
    assert json.loads(json.dumps(result)) == result, "comes back from a file as it was"


def test_later_races_of_a_seed_are_the_rest_of_the_same_ones() -> None:
    whole, rest = run_cell(cell_of()), run_cell(make_cell("heuristic", RACE, None, seed=7, races=10, first_race=20))
    assert rest["driven"] == whole["driven"][20:]
    assert rest["position"] == whole["position"][20:]


def test_a_strategist_that_cannot_call_a_race_is_left_out_with_the_reason() -> None:
    result = run_cell(cell_of("fixed", "bahrain-2024"))
    assert list(result) == ["left_out"]
    assert "no published strategies" in result["left_out"]


def test_rivals_on_plans_are_another_race() -> None:
    reactive, plans = run_cell(cell_of(rivals="reactive")), run_cell(cell_of(rivals="plans"))
    assert reactive["position"] == run_cell(cell_of())["position"]
    assert np.mean(np.array(reactive["position"]) != plans["position"]) > 0.2
    with pytest.raises(RsrlError, match=r"unknown option rivals=asleep; there are rivals=reactive\|plans"):
        cell_of(rivals="asleep")


def test_the_key_names_everything_the_result_depends_on() -> None:
    cell = cell_of()
    changes: list[dict[str, Any]] = [
        {"strategist": "fixed"}, {"race": "japan-2023"}, {"driver": "RUS"}, {"seed": 8}, {"races": 31}, {"first_race": 1},
        {"options": (("rivals", "plans"),)}, {"race_hash": "x"}, {"code_hash": "x"}, {"model_hash": "x"},
    ]  # fmt: skip
    assert {c for change in changes for c in change} == {f.name for f in dataclasses.fields(Cell)}
    keys = {dataclasses.replace(cell, **change).key for change in changes}
    assert len(keys) == len(changes)
    assert cell.key not in keys
    assert cell.key == cell_of().key
    assert cell.key.startswith("bahrain-2023_HAM_heuristic_")


def test_the_code_of_a_cell_is_all_that_decides_how_a_race_comes_out() -> None:
    names = {str(path.relative_to(SOURCE)) for path in code_files()}
    assert all(path.is_file() for path in code_files())
    assert {"rollouts/plans.py", "strategists/lookahead/planner.py", "strategists/plan_search/hindsight.py", "season/records.py"} <= names
    # What these sources import is among them, but for what changes no race: messages, statistics of a result, pictures, how text is
    # read, where compiled code is kept, and the registration with Gymnasium.
    imported = {package for path in code_files() for _, package in imported_packages(path.read_text(encoding="utf-8"))}
    known = {name.partition("/")[0].removesuffix(".py") for name in names}
    harmless = {
        "__version__", "cache_folder", "compile_watch", "drawing", "errors", "registration", "results", "standard_error", "statistics",
        "text_files",
    }  # fmt: skip
    assert imported - known <= harmless


def test_another_version_has_other_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    before = cell_of().key
    monkeypatch.setattr("rsrl.evaluation.study.cells.__version__", "0.0.0")
    assert cell_of().key != before


def test_a_model_is_known_by_its_content_not_its_place(tmp_path: Path) -> None:
    copy = shutil.copytree(find_model(RACE), tmp_path / "copy")
    shipped, copied = cell_of(RACE), cell_of(str(copy))
    assert shipped.key == copied.key
    assert run_cell(shipped)["driven"] == run_cell(copied)["driven"]
    (copy / "model.json").write_text((copy / "model.json").read_text() + "\n")
    assert cell_of(str(copy)).key != shipped.key
    with pytest.raises(RsrlError, match="the model changed while the study ran"):
        run_cell(copied)


def test_a_race_is_known_by_its_figures(tmp_path: Path) -> None:
    path = tmp_path / "bahrain-2023.toml"
    text = (shipped_folder() / f"{RACE}.toml").read_text()
    path.write_text(text)
    cell = cell_of(race=str(path))
    assert cell.race_hash == cell_of().race_hash
    path.write_text(text.replace(f"laps = {load_race(RACE).laps}", "laps = 50"))
    with pytest.raises(RsrlError, match="the figures here are not those the cell was made for"):
        run_cell(cell)


@pytest.mark.parametrize(
    ("strategist", "race", "driver", "message"),
    [
        ("oracle", RACE, None, "no model 'oracle'"),
        ("fixed", "atlantis-2023", None, "unknown race 'atlantis-2023'"),
        ("fixed", RACE, "SEN", "unknown driver 'SEN'"),
    ],
)
def test_a_cell_that_cannot_be_is_refused(strategist: str, race: str, driver: str | None, message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        make_cell(strategist, race, driver, seed=7, races=1)


def test_a_store_gives_back_what_was_put_in(tmp_path: Path) -> None:
    store = Store(tmp_path / "new", {"seed": 7})
    assert store.get(cell_of()) is None
    store.put(cell_of(), {"position": [1, 2]})
    again = Store(tmp_path / "new", {"seed": 7})
    assert again.get(cell_of()) == {"position": [1, 2]}
    assert again.get(cell_of("fixed")) is None


def test_a_folder_of_another_version_or_settings_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Store(tmp_path, {"seed": 7}).put(cell_of(), {"position": [1]})
    with pytest.raises(RsrlError, match=r"holds a study of seed 7, not 8; choose another --out, or take the folder over with --force"):
        Store(tmp_path, {"seed": 8})
    monkeypatch.setattr("rsrl.evaluation.study.store.__version__", "9.9.9")
    with pytest.raises(RsrlError, match=r"holds a study of version '.*', not '9\.9\.9'"):
        Store(tmp_path, {"seed": 7})
    assert Store(tmp_path, {"seed": 7}, force=True).get(cell_of()) == {"position": [1]}, "nothing is lost"


def test_a_broken_cell_file_is_named(tmp_path: Path) -> None:
    store = Store(tmp_path, {})
    store.put(cell_of(), {"position": [1]})
    (path,) = (tmp_path / "cells").iterdir()
    path.write_text("{")
    with pytest.raises(RsrlError, match=r"\.json: not the result of a cell .*; delete it"):
        store.get(cell_of())


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(RsrlError, match="cannot be written to"):
        Store(tmp_path / "file" / "sub", {})
