"""Result files that cannot be reported are told of in one line, each with where it fails."""

import json
from pathlib import Path
from typing import Any

import pytest
from report_study import PROVENANCE, evaluation, report_of, robustness, study

from rsrl import __version__
from rsrl.errors import RsrlError
from rsrl.report import make_report, read_results


def refused(folder: Path) -> str:
    with pytest.raises(RsrlError) as caught:
        make_report(folder, "rsrl report", "2026-11-25T08:00:00+00:00")
    return str(caught.value)


def test_no_such_folder_and_none_of_the_files(tmp_path: Path) -> None:
    assert refused(tmp_path / "none").endswith("none: no such folder; name one made by rsrl study or rsrl evaluate --out")
    (tmp_path / "table3.md").write_text("x")
    assert "nothing to report; it holds none of generalise.json, evaluation.json, robustness.json" in refused(tmp_path)


@pytest.mark.parametrize("content", ["{", "", "{'a': 1}", '{"races": NaN}', "\xff"])
def test_what_is_no_json(tmp_path: Path, content: str) -> None:
    (tmp_path / "evaluation.json").write_bytes(content.encode("latin-1"))
    assert "evaluation.json: is no JSON (" in refused(tmp_path)


def test_a_file_that_cannot_be_opened(tmp_path: Path) -> None:
    (tmp_path / "evaluation.json").mkdir()
    assert "evaluation.json: cannot be read (" in refused(tmp_path)


def test_another_format_names_the_version_that_made_it(tmp_path: Path) -> None:
    document = {"study": "generalise", "format": 2, "provenance": PROVENANCE | {"version": "0.9.0"}}
    (tmp_path / "generalise.json").write_text(json.dumps(document))
    assert f"is of format 2, RSRL {__version__} reads format 1 (it was made by RSRL 0.9.0)" in refused(tmp_path)


def test_what_differs_is_named_with_its_place(tmp_path: Path) -> None:
    document = evaluation()
    document["provenance"] = PROVENANCE | {"version": "0.0.1"}
    document["rows"][1]["difference_ci95"] = [0.0]
    (tmp_path / "evaluation.json").write_text(json.dumps(document))
    message = refused(tmp_path)
    assert "evaluation.json: rows[1].difference_ci95: expected array of length 2, got 1; this is no result of rsrl evaluate" in message
    assert "(it was made by RSRL 0.0.1)" in message


@pytest.mark.parametrize(
    ("place", "value", "complaint"),
    [
        (("tracks", "table", 0, "mean_position"), "6", "tracks.table[0].mean_position: expected float, got str"),
        (("tracks", "table", 0, "best"), 1, "tracks.table[0].best: expected bool, got int"),
        (("tracks", "strategies", 0, "compounds", 0), 3, "tracks.strategies[0].compounds[0]: expected int <= 2"),
        (("tracks", "strategies", 0, "compounds", 0), [], "tracks.strategies[0].compounds[0]: expected int, got array"),
        (("tracks", "strategies", 0, "laps"), [3, 9], "tracks.strategies[0]: laps and windows have not one entry for each stop"),
        (("tracks", "races"), {}, "tracks.races: expected array, got object"),
        (("cars",), None, "cars: expected array, got null"),
        (("seed",), True, "seed: expected int, got bool"),
        (("provenance", "date"), "yesterday", "provenance: 'yesterday' is not a date"),
        (("provenance",), [], "provenance: expected object, got array"),
    ],
)
def test_every_kind_of_difference(tmp_path: Path, place: tuple[str | int, ...], value: object, complaint: str) -> None:
    document: Any = study()
    inner = document
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = value
    (tmp_path / "generalise.json").write_text(json.dumps(document))
    assert complaint in refused(tmp_path)


def test_a_missing_field_and_a_file_that_is_a_list(tmp_path: Path) -> None:
    document = robustness()
    del document["rows"][0]["against"][0]["p_better"]
    (tmp_path / "robustness.json").write_text(json.dumps(document))
    assert "robustness.json: rows[0].against[0]: object missing required field p_better" in refused(tmp_path)
    (tmp_path / "robustness.json").write_text("[]")
    assert "robustness.json: the whole: expected object, got array" in refused(tmp_path)


def test_intervals_that_cannot_be_told_are_left_out(tmp_path: Path) -> None:
    document = study()
    for row in document["tracks"]["table"] + document["tracks"]["averages"] + document["tracks"]["differences"]:
        row["ci95"] = None
    for row in document["tracks"]["gap_closed"]:
        row["share"], row["ci95"] = None, [None, None]
    report = report_of(tmp_path, generalise=document)
    assert "None" not in report.html
    assert "nan" not in report.html


def test_files_found(tmp_path: Path) -> None:
    report_of(tmp_path, robustness=robustness(), evaluation=evaluation())
    found = read_results(tmp_path)
    assert found.generalise is None
    assert list(found.files()) == ["evaluation.json", "robustness.json"]
