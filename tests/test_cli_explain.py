"""`rsrl explain` and `rsrl study explanations`: text, JSON, page, and what is refused in one line."""

import json
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rsrl.cli import main
from rsrl.cli.explain_options import TARGETS
from rsrl.cli.study_explanations import goals_table
from rsrl.explanation import load_explained
from rsrl.explanation.fidelity.goals import GOALS, Goal, judge
from rsrl.explanation.fidelity.paper import FirstStops, beside_the_paper
from rsrl.report import explanation_page, make_report
from rsrl.report.safety_cars import lines
from rsrl.strategists.tree import Tree, save_tree

Capture = pytest.CaptureFixture[str]
LAP = ["explain", "--race", "bahrain-2023", "--lap", "10", "--race-number", "3"]
QUICK = [*LAP, "--races", "64"]


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    """What `rsrl explain --json` has for a summary, made once."""
    import contextlib
    import io

    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert main([*LAP, "--method", "summary", "--json"]) == 0
    found: dict[str, Any] = json.loads(printed.getvalue())
    return found


@pytest.fixture(scope="module")
def everything() -> dict[str, Any]:
    """What `rsrl explain --json` has for every method and the safety-car table, made once."""
    import contextlib
    import io

    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert main([*QUICK, "--safety-car-table", "--json"]) == 0
    found: dict[str, Any] = json.loads(printed.getvalue())
    return found


def one_leaf(model_hash: str, race: str = "bahrain-2023") -> Tree:
    """A tree that always stays out."""
    nothing = np.array([-1], np.int32)
    return Tree(
        nothing, np.zeros(1, np.float32), nothing, nothing, np.zeros(1, np.int8), np.ones((1, 4), np.int64),
        ("laps_left",), "all", model_hash, race,
    )  # fmt: skip


def refused(capsys: Capture, arguments: list[str]) -> str:
    assert main(arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[-1].startswith("rsrl: error: ")
    return lines[-1].removeprefix("rsrl: error: ")


def test_json_is_one_object_with_decision_state_and_explanations(document: dict[str, Any]) -> None:
    assert (document["race"], document["driver"], document["lap"]) == ("bahrain-2023", "HAM", 10)
    assert document["decision"]["call"] in document["decision"]["legal"]
    assert [one["method"] for one in document["explanations"]] == ["summary"]
    assert document["state"]["laps_completed"] == 9
    assert document["provenance"]["command"].startswith("rsrl explain --race bahrain-2023 --lap 10")
    assert [row["question"] for row in document["paper"]][-1] == "does HAM stop as Verstappen did?"


def test_everything_for_one_lap_what_if_first(capsys: Capture, tmp_path: Path) -> None:
    page = tmp_path / "lap.html"
    assert main([*QUICK, "--html", str(page), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    methods = [one["method"] for one in told["explanations"]]
    assert methods[0] == "what-if"
    assert {"what-if", "attribution", "counterfactual", "summary"} <= set(methods)
    html = page.read_text(encoding="utf-8")
    headings = re.findall(r"<h2>\d+\. ([^<]*)</h2>", html)
    assert headings[0].startswith("What if")
    assert headings[1:4] == ["If a safety car came out now", "If a virtual safety car came out now", "The decision"]
    assert "http" not in re.sub(r'http-equiv="', "", html), "the page asks for nothing from outside"
    assert "<script" not in html
    for one in told["explanations"]:
        assert all(isinstance(sentence, str) and sentence for sentence in one["sentences"])
    assert main([*QUICK]) == 0
    text = capsys.readouterr().out
    assert text.index("Change in finishing position against") < text.index("The policy's value of each call") < text.index("HAM starts")


def test_a_state_of_json_explains_the_same_call(capsys: Capture, tmp_path: Path, document: dict[str, Any]) -> None:
    path = tmp_path / "state.json"
    path.write_text(json.dumps(document["state"]))
    assert main(["explain", "--state", str(path), "--method", "attribution", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["race"], told["lap"], told["driver"]) == ("bahrain-2023", 10, "HAM")
    assert told["decision"]["call"] == document["decision"]["call"]
    for name, value in document["decision"]["q_values"].items():
        assert told["decision"]["q_values"][name] == pytest.approx(value, abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--race", "bahrain-2023", "--lap", "58"], "lap 58 is outside the race: bahrain-2023 has laps 1 to 57"),
        (["--race", "bahrain-2023", "--lap", "0"], "lap 0 is outside the race"),
        (["--race", "atlantis-2023", "--lap", "5"], "unknown race 'atlantis-2023'"),
        (["--lap", "5"], "all is a policy for all: name the race to explain with --race"),
        (["--race", "bahrain-2023"], "which lap? give --lap, or --state"),
        (["--race", "bahrain-2023", "--lap", "5", "--method", "oracle"], "unknown --method 'oracle'; there are what-if, attribution"),
        (["--race", "bahrain-2023", "--lap", "5", "--level", "deep"], "unknown --level 'deep'"),
        (["--race", "bahrain-2023", "--lap", "5", "--target", "wet"], "unknown --target 'wet'; there are stay, soft, medium, hard"),
        (
            ["--race", "bahrain-2023", "--lap", "5", "--background", "night"],
            "--background night: neither lap-aligned nor average, nor a file",
        ),
        (["nobody", "--race", "bahrain-2023", "--lap", "5"], "no model 'nobody'"),
        (["--race", "bahrain-2023", "--lap", "5", "--driver", "XXX"], "unknown driver 'XXX'"),
        (["--state", "nowhere.json"], "nowhere.json: cannot be read"),
    ],
)
def test_what_cannot_be_explained_is_told_in_one_line(capsys: Capture, arguments: list[str], message: str) -> None:
    assert refused(capsys, ["explain", *arguments]).startswith(message)


def test_a_race_that_is_over_is_told(capsys: Capture) -> None:
    from rsrl.season import load_race

    policy, record = load_explained("all"), load_race("bahrain-2023")
    from rsrl.explanation import record_episode

    number, driven = next(
        (n, d) for n, d in ((n, record_episode(policy, record, record.car_index("HAM"), race=n)) for n in range(50)) if d.retired
    )
    lap = driven.laps + 1
    message = refused(capsys, ["explain", "--race", "bahrain-2023", "--lap", str(lap), "--race-number", str(number)])
    assert message.startswith(f"the race of HAM is over after lap {driven.laps}; choose a lap up to {driven.laps}, or another race")
    offered = int(message.split("--race-number ")[1].split(",")[0])
    assert not record_episode(policy, record, record.car_index("HAM"), race=offered).retired


def test_the_default_race_is_one_that_the_car_finishes(capsys: Capture) -> None:
    from rsrl.explanation import record_episode
    from rsrl.season import load_race

    policy, record = load_explained("all"), load_race("bahrain-2023")
    retired = (record_episode(policy, record, record.car_index("HAM"), race=number).retired for number in range(100))
    first = next(number for number, out in enumerate(retired) if not out)
    assert first > 0, "HAM retires from race 0, or this test says nothing"
    late = ["explain", "--race", "bahrain-2023", "--lap", "20", "--method", "summary"]
    assert main([*late, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["race_number"] == first
    assert main(late) == 0
    assert f"HAM at bahrain-2023, race {first} of seed 0, lap 20: " in capsys.readouterr().out
    assert f"such as --race-number {first}, which HAM finishes" in refused(capsys, [*late, "--race-number", "0"])


@pytest.mark.parametrize("width", [80, 100, 120])
def test_the_text_fits_the_terminal(capsys: Capture, monkeypatch: pytest.MonkeyPatch, width: int, everything: dict[str, Any]) -> None:
    from rsrl.cli.explain_tables import tables
    from rsrl.cli.output import Output

    monkeypatch.setenv("COLUMNS", str(width))
    Output(False).result({}, *tables(everything))
    text = capsys.readouterr().out
    assert max(len(line) for line in text.splitlines()) <= width
    assert "…" not in text
    assert "..." not in text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"laps_completed": 57}, "laps_completed is 57 of 57: the race is over"),
        ({"sets_left": None}, "sets_left is null"),
        ({"total_laps": 60}, "total_laps is 60; bahrain-2023 has 57"),
    ],
)
def test_an_impossible_state_names_its_field(
    capsys: Capture, tmp_path: Path, document: dict[str, Any], change: dict[str, Any], message: str
) -> None:
    path = tmp_path / "state.json"
    path.write_text(json.dumps(document["state"] | change))
    assert message in refused(capsys, ["explain", "--state", str(path)])


@pytest.mark.parametrize(("field", "value"), [("last_lap_s", 9.5), ("gap_to_leader_s", 1e6)])
def test_a_time_that_nobody_drives_names_its_field(
    capsys: Capture, tmp_path: Path, document: dict[str, Any], field: str, value: float
) -> None:
    state = json.loads(json.dumps(document["state"]))
    last = max((car for car in state["cars"] if car["running"]), key=lambda car: car["position"])
    last[field] = value
    path = tmp_path / "state.json"
    path.write_text(json.dumps(state))
    message = refused(capsys, ["explain", "--state", str(path)])
    assert f"({last['driver']}): {field} is {value}; it must be at " in message


def test_state_and_other_options_must_agree(capsys: Capture, tmp_path: Path, document: dict[str, Any]) -> None:
    path = tmp_path / "state.json"
    path.write_text(json.dumps(document["state"]))
    assert "so the call is for lap 10, not 12" in refused(capsys, ["explain", "--state", str(path), "--lap", "12"])
    assert "leave --driver out" in refused(capsys, ["explain", "--state", str(path), "--driver", "VER"])
    assert "race is bahrain-2023, not spain-2023" in refused(capsys, ["explain", "--state", str(path), "--race", "spain-2023"])


def test_a_tree_of_another_model_or_race_is_refused(capsys: Capture, tmp_path: Path) -> None:
    path = tmp_path / "tree.json"
    save_tree(one_leaf("0" * 16), path)
    assert "a tree of another model" in refused(capsys, [*LAP, "--method", "tree", "--tree", str(path)])
    save_tree(one_leaf(load_explained("all").hash, "spain-2023"), path)
    assert "a tree for spain-2023, not for bahrain-2023" in refused(capsys, [*LAP, "--method", "tree", "--tree", str(path)])


def test_a_tree_that_was_never_fitted_names_the_command(capsys: Capture) -> None:
    message = refused(capsys, ["explain", "--race", "canada-2023", "--lap", "9", "--driver", "SAR", "--method", "tree"])
    assert message == ("no tree of all for SAR at canada-2023; fit one with `rsrl explain all --race canada-2023 --driver SAR --fit-tree`")


def test_the_command_named_for_a_missing_tree_does_fit_one(capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from rsrl.cli import explain_run

    fitted: list[str] = []

    def fit(scenario: Any, request: Any, output: Any) -> Tree:
        assert request.fit_tree
        fitted.append(f"{scenario.policy.name} {scenario.record.name} {scenario.record.cars[scenario.car].driver}")
        return one_leaf(scenario.policy.hash)

    message = refused(capsys, ["explain", "--race", "canada-2023", "--lap", "9", "--driver", "SAR", "--method", "tree"])
    monkeypatch.setattr(explain_run, "_found_tree", fit)
    command = message.split("`")[1].split()
    assert main([*command[1:], "--tree-page", str(tmp_path / "tree.html")]) == 0
    assert fitted == ["all canada-2023 SAR"]
    assert (tmp_path / "tree.html").is_file()


def test_a_background_of_another_schema_is_refused(capsys: Capture, tmp_path: Path) -> None:
    path = tmp_path / "background.json"
    path.write_text(json.dumps({"downforce": 1.0}))
    message = refused(capsys, [*LAP, "--method", "attribution", "--background", str(path)])
    assert "downforce is no feature of this version; it belongs to another schema" in message


def test_one_legal_call_is_explained_as_such(capsys: Capture) -> None:
    assert (
        main(
            [
                "explain",
                "--race",
                "bahrain-2023",
                "--lap",
                "57",
                "--race-number",
                "3",
                "--method",
                "attribution,tree,counterfactual",
                "--json",
            ]
        )
        == 0
    )
    told = json.loads(capsys.readouterr().out)
    assert told["decision"]["legal"] == ["no pit"]
    assert told["explanations"] == []
    assert told["notes"][0] == "Only one call is legal for lap 57: stay out. There is no decision to explain."


def test_another_call_that_cannot_be_asked_for_is_refused_before_anything_is_made(
    capsys: Capture, tmp_path: Path, document: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from rsrl.cli import explain_run

    def made(*_: object) -> None:
        raise AssertionError("worked out in vain")

    monkeypatch.setattr(explain_run, "MAKERS", dict.fromkeys(explain_run.MAKERS, made))
    made_already = next(option for option, name in TARGETS.items() if name == document["decision"]["call"])
    message = refused(capsys, [*LAP, "--target", made_already])
    assert message.startswith(f"--target {made_already}: ")
    assert "is the call already made for lap 10; ask for " in message
    state = tmp_path / "state.json"
    state.write_text(json.dumps(document["state"] | {"sets_left": [2, 0, 1]}))
    message = refused(capsys, ["explain", "--state", str(state), "--target", "medium"])
    assert message.startswith("--target medium: box for medium may not be called for lap 10; ask for ")


def test_a_state_has_no_race_to_sum_up(capsys: Capture, tmp_path: Path, document: dict[str, Any]) -> None:
    state = tmp_path / "state.json"
    state.write_text(json.dumps(document["state"]))
    assert "a summary needs a whole race" in refused(capsys, ["explain", "--state", str(state), "--method", "summary"])
    assert "--race-number 4 names a simulated race" in refused(capsys, ["explain", "--state", str(state), "--race-number", "4"])
    assert main(["explain", "--state", str(state), "--races", "64", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert "summary" not in [one["method"] for one in told["explanations"]]
    assert "Left out: a summary needs a whole race, and a state file holds a single moment." in told["notes"]


def test_without_a_tree_the_rest_is_explained_and_the_command_that_fits_one_is_named(capsys: Capture) -> None:
    assert main(["explain", "--race", "canada-2023", "--driver", "SAR", "--lap", "9", "--method", "all", "--races", "32", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    methods = {one["method"] for one in told["explanations"]}
    assert {"what-if", "attribution", "counterfactual", "summary"} <= methods
    assert "tree" not in methods
    (note,) = told["notes"]
    assert note.endswith("fit one with `rsrl explain all --race canada-2023 --driver SAR --fit-tree`.")


def test_people_read_box_and_stay_out_while_json_keeps_its_names(capsys: Capture, tmp_path: Path) -> None:
    page = tmp_path / "lap.html"
    assert main([*QUICK, "--html", str(page)]) == 0
    text = capsys.readouterr().out
    for read in (text, page.read_text(encoding="utf-8")):
        assert "box for hard" in read
        assert not re.search(r"no pit|pit (soft|medium|hard)", read)
    assert not re.search(r"\d\.\d{4}", text), "no more digits than a number bears"


def test_a_file_that_cannot_be_written_is_told_before_the_work_with_its_option(capsys: Capture, tmp_path: Path) -> None:
    assert refused(capsys, [*LAP, "--html", str(tmp_path), "--force"]) == f"{tmp_path}: is a folder; name a file with --html"
    page = tmp_path / "page.html"
    page.write_text("mine")
    assert (
        refused(capsys, [*LAP, "--tree-page", str(page)]) == f"{page} already exists; give another --tree-page, or --force to overwrite it"
    )


def test_work_that_takes_long_is_told_of_and_quick_work_is_not(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    from rsrl.cli import progress
    from rsrl.cli.output import Output

    monkeypatch.setattr(progress, "PATIENCE_S", 0.05)
    with progress.brief(Output(True), "Explaining") as step:
        step("what-if")
        time.sleep(0.3)
    assert capsys.readouterr().err == "Explaining: what-if ...\n"
    with progress.brief(Output(True), "Explaining"):
        pass
    time.sleep(0.1)
    assert capsys.readouterr().err == ""


def test_the_safety_car_table_has_a_line_a_lap_with_both_answers() -> None:
    row = {"label": "", "lap": 7, "compound": "S", "tyre_age_laps": 6, "on_plan": True, "share_of_races": 0.64, "stop_tried": "pit hard"}
    safety_car = row | {
        "track_status": "safety car",
        "call": "pit hard",
        "share_calling_it": 0.6875,
        "value": -0.654,
        "standard_error": 0.1,
    }
    virtual = row | {
        "track_status": "virtual safety car", "call": "no pit", "share_calling_it": 1.0, "value": 0.2, "standard_error": 0.05,
    }  # fmt: skip
    (line,) = lines([safety_car, virtual])
    assert (line.lap, line.tyre, line.age_laps, line.on_plan) == (7, "soft", 6, True)
    assert [(answer.call, answer.worth) for answer in line.answers] == [("box for hard (69 %)", "+0.65 ±0.20"), ("stay out", "+0.20 ±0.10")]
    (alone,) = lines([virtual | {"on_plan": False}])
    assert [answer.call for answer in alone.answers] == ["\N{EN DASH}", "stay out"]


def test_nothing_is_overwritten_unless_told(capsys: Capture, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text("mine")
    assert "already exists" in refused(capsys, [*LAP, "--html", str(page)])
    assert page.read_text() == "mine"


def test_page_escapes_what_it_is_given(document: dict[str, Any]) -> None:
    nasty = json.loads(json.dumps(document).replace("HAM starts", "<script>alert(1)</script> starts"))
    html = explanation_page(nasty, "rsrl explain", document["provenance"]["date"])
    assert "<script>" not in html
    assert "&lt;script&gt;alert(1)" in html


def test_report_shows_a_stored_explanation(tmp_path: Path, document: dict[str, Any]) -> None:
    (tmp_path / "explanation.json").write_text(json.dumps(document))
    report = make_report(tmp_path, "rsrl report", document["provenance"]["date"])
    assert [section.id for section in report.sections] == ["decision", "summary", "paper", "reading", "again"]
    del document["explanations"][0]["rows"][0]["lap"]
    (tmp_path / "explanation.json").write_text(json.dumps(document))
    from rsrl.errors import RsrlError

    with pytest.raises(RsrlError, match=r"explanations\[0\]: rows\[0\]: object missing required field lap"):
        make_report(tmp_path, "rsrl report", document["provenance"]["date"])


def test_study_holds_figures_against_goals_and_hides_none(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "study"
    arguments = ["study", "explanations", "--races", "2", "--method", "attribution", "--out", str(out)]
    assert main([*arguments, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert len(told["goals"]) == sum(goal.method == "attribution" for goal in GOALS)
    assert all(one["value"] is not None and one["met"] is None for one in told["goals"]), "two races judge nothing"
    assert json.loads((out / "explanations.json").read_text())["figures"] == told["figures"]
    assert "already exists" in refused(capsys, arguments)
    assert "unknown --method 'oracle'; there are attribution, tree" in refused(capsys, ["study", "explanations", "--method", "oracle"])


def test_goals_are_judged_by_what_was_measured() -> None:
    goals = (
        Goal("tree", "leaves", "", "leaves", "<=", 48.0),
        Goal("tree", "accuracy", "", "labels.accuracy", ">", "labels.majority"),
        Goal("tree", "places", "", "behind.value", "<", 0.2, 1920),
        Goal("tree", "nothing", "", "not.there", "<", 1.0),
    )
    figures = {"tree": {"races": 100, "leaves": 48, "labels": {"accuracy": 0.9, "majority": 0.95}, "behind": {"value": 0.1}}}
    judged = judge(goals, figures)
    assert [one.met for one in judged] == [True, False, None, None]
    assert judged[1].bound == 0.95
    assert judged[2].why == "to be judged over 1,920 races, measured over 100"
    assert judged[3].why == "not measured"
    assert {goal.method for goal in GOALS} == {"attribution", "tree", "counterfactual", "what-if", "all"}


def test_what_holds_by_construction_is_no_goal_met() -> None:
    goals = [Goal("tree", "leaves", "", "leaves", "=", 3.0, by_construction=by_construction) for by_construction in (True, False)]
    judged = [one.document() for leaves in (3, 4) for one in judge(goals, {"tree": {"leaves": leaves}})]
    shown = goals_table(judged, "a policy")
    assert [row[5].plain for row in shown.rows] == ["by construction", "met", "MISSED", "MISSED"]
    assert shown.captions == ["1 met, 2 missed, 1 by construction, 0 not judged"]


@pytest.mark.parametrize(("lap", "compound", "agrees"), [(14, 0, True), (14, 2, False), (20, 0, False)])
def test_stops_agree_with_verstappens_where_lap_and_tyre_do(lap: int, compound: int, agrees: bool) -> None:
    stops = FirstStops("VER", 10, np.full(10, lap), np.full(10, compound))
    rows = beside_the_paper([], [stops])
    assert [row["agrees"] for row in rows] == [agrees]
    assert f"VER first boxes on lap {lap}" in rows[0]["ours"]
