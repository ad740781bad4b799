"""Result files: every one in benchmarks/results decodes into its struct and back, and a wrong field is named in one line."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from rsrl.errors import RsrlError
from rsrl.evaluation.robustness import RobustnessPlan
from rsrl.results import (
    BacktestResult,
    Bench,
    EngineRatio,
    Evaluation,
    ExplanationStudy,
    GapParts,
    Illustrations,
    LateLapsResult,
    OwnPlansResult,
    PaperAgentCurves,
    PassesResult,
    PlansResult,
    PublishedResult,
    Result,
    RivalsResult,
    Robustness,
    SeasonAudit,
    SeasonTable,
    StudyResult,
    WorthOfThinking,
    from_plain,
    half_width,
    known,
    plain,
    read_result,
    to_json,
)

RESULTS = Path(__file__).parents[1] / "benchmarks" / "results"
KINDS: dict[str, type[Result]] = {
    "audit-": SeasonAudit,
    "backtest-": BacktestResult,
    "bench": Bench,
    "demo": Evaluation,
    "engine-ratio": EngineRatio,
    "explanations": ExplanationStudy,
    "gap-parts": GapParts,
    "generalise": StudyResult,
    "held-out-and-cars": StudyResult,
    "illustrations": Illustrations,
    "late-laps": LateLapsResult,
    "leaderboard-": Evaluation,
    "own-race-plans": OwnPlansResult,
    "paper-agents-curves": PaperAgentCurves,
    "passes": PassesResult,
    "planner-1s": Evaluation,
    "published-plans": PublishedResult,
    "rivals": RivalsResult,
    "robustness": Robustness,
    "season-": SeasonTable,
    "seeds-": Evaluation,
    "worth-of-thinking": WorthOfThinking,
}
FILES = sorted(RESULTS.glob("*.json"))


def kind_of(path: Path) -> type[Result]:
    if path.stem.startswith("backtest-") and path.stem.endswith("-plans"):
        return PlansResult
    (kind,) = [kind for name, kind in KINDS.items() if path.stem.startswith(name)]
    return kind


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_published_result_is_read_and_written_without_loss(path: Path) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    assert json.loads(to_json(read_result(path, kind_of(path), "a command"))) == content


def test_every_kind_has_a_file() -> None:
    assert {kind_of(path) for path in FILES} == {*KINDS.values(), PlansResult}


def test_a_plan_of_robustness_that_is_all_defaults_stands_whole_in_its_file() -> None:
    assert plain(RobustnessPlan()).keys() == {"rivals", "scales", "draws", "races", "first_race", "informed"}


def demo() -> Any:
    return json.loads((RESULTS / "demo.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (demo() | {"races": "many"}, "races: expected int, got str"),
        (demo() | {"rows": [demo()["rows"][0] | {"ci95": [1.0]}]}, r"rows\[0\].ci95: expected array of length 2, got 1"),
        ({name: value for name, value in demo().items() if name != "driver"}, "the whole: object missing required field driver"),
        (demo() | {"provenance": demo()["provenance"] | {"date": "yesterday"}}, "provenance: 'yesterday' is not a date"),
        ([], "the whole: expected object, got array"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, content: Any, complaint: str) -> None:
    path = tmp_path / "evaluation.json"
    path.write_text(json.dumps(content))
    with pytest.raises(RsrlError, match=rf"^\S+evaluation.json: {complaint}; this is no result of rsrl evaluate") as caught:
        read_result(path, Evaluation, "rsrl evaluate")
    assert "\n" not in str(caught.value)


def test_what_may_be_absent_is_left_out_and_nan_is_null(tmp_path: Path) -> None:
    evaluation = from_plain(demo(), Evaluation)
    assert evaluation.aggregate is None
    assert "aggregate" not in plain(evaluation)
    assert plain({"a": math.nan, "b": (1, math.inf)}) == {"a": None, "b": [1, None]}


def test_intervals() -> None:
    assert known((1.0, 2.0)) == (1.0, 2.0)
    assert known(None) is known((None, 1.0)) is known((math.nan, 1.0)) is None
    assert half_width(2.0, (1.0, 3.5)) == 1.5
    assert math.isnan(half_width(2.0, (None, None)))
