"""Every table of every command at the widths of real terminals, and on streams that lack our signs."""

import io
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec
import pytest
from report_study import evaluation, robustness, study
from rich.text import Text

from rsrl import cli
from rsrl.calibration.calibrate import Diagnosis
from rsrl.cli import main
from rsrl.cli.backtest import races_table, summary_table
from rsrl.cli.calibrate import overview_table
from rsrl.cli.leaderboard import leaderboard_table
from rsrl.cli.output import Column, FittedTable, Output, Shown, table
from rsrl.cli.plan import plans_table
from rsrl.cli.progress import progress, steps
from rsrl.cli.seeds import seeds_table
from rsrl.cli.simulate import cars_table
from rsrl.cli.study_explanations import goals_table
from rsrl.cli.study_robustness import robustness_table
from rsrl.cli.study_tables import tables as study_tables
from rsrl.evaluation.backtest.run import Backtest, RaceScores
from rsrl.explanation.fidelity.goals import GOALS, judge
from rsrl.plain_signs import plain_signs
from rsrl.results import Aggregate, Comparison, Evaluation, Robustness, StudyResult, from_plain
from rsrl.season import RaceRecord
from rsrl.simulator import CarSummary

WIDTHS: Final = (80, 100, 120, 200)
ELLIPSIS: Final = re.compile(r"…|\.\.\.")
LINE: Final = "─"
MEASURES: Final = (
    "mae_position", "mae_rank_classified", "spearman", "brier_points", "mae_green_lap_s", "stops_mae", "first_stop_within_3",
)  # fmt: skip


def leaderboard(bahrain: RaceRecord) -> list[Shown]:
    result = leaderboard_rows("planner-1s", "best-plan-sc", "imitation", "rsrl runs/first", "dp")
    without = tuple(msgspec.structs.replace(row, gap_closed=None, gap_closed_ci95=None) for row in result.rows)
    return [
        leaderboard_table(bahrain, result, "rsrl runs/first"),
        leaderboard_table(bahrain, msgspec.structs.replace(result, rows=without), "dp"),
    ]


def leaderboard_rows(*names: str) -> Evaluation:
    """A result with strategists of these names."""
    document = evaluation()
    return from_plain(
        document | {"rows": [row | {"strategist": name} for name, row in zip(names, document["rows"] * 2, strict=False)]}, Evaluation
    )


def seeds(bahrain: RaceRecord) -> list[Shown]:
    against = tuple(Comparison(name, -0.31, (-0.52, -0.11), 0.47, (0.44, 0.5)) for name in ("best-plan-sc", "planner-1s"))
    return [seeds_table(Aggregate(3, 10.25, (9.9, 10.6), 10.22, (9.95, 10.5), against))]


def cars(bahrain: RaceRecord) -> list[Shown]:
    found = [CarSummary(car.driver, car.team, car.grid, 10.25, 1.0, 0.523, 0.871, 0.125, 2.25, []) for car in bahrain.cars]
    return [cars_table("Bahrain Grand Prix 2023: 2,000 races in 0.10 s (19,999 a second), seed 0", found, "HAM")]


def plans(bahrain: RaceRecord) -> list[Shown]:
    stops = [{"lap": lap, "compound": c, "window": [lap - 9, lap + 9]} for lap, c in ((12, "H"), (32, "M"), (60, "S"))]
    row = {
        "plan": "S-H@12-M@32-S@60", "start": "S", "stops": stops, "sc_window_laps": 12, "vsc_window_laps": 10, "mean_position": 10.25,
        "ci95": [10.1, 10.4], "behind_best": 10.12, "behind_best_ci95": [10.0, 10.2], "mean_points": 10.25, "p_best": 1.0,
    }  # fmt: skip
    return [plans_table("Best plans of HAM, Monaco Grand Prix 2023: 9,999,999 legal plans", [row] * 3, 78, rule) for rule in (False, True)]


def overview(bahrain: RaceRecord) -> list[Shown]:
    warnings = ("wet", "few laps: wear leans on other tracks", "worst stint off by more than half a second")
    return [
        overview_table([Diagnosis("united-states-2023", False, 999, 900, 3, 0.31, 1.21, 101.25, (0.101, 0.08, 0.05), 22.5, 0.81, warnings)])
    ]


def backtest(bahrain: RaceRecord) -> list[Shown]:
    one = dict.fromkeys(MEASURES, 12.25)
    predictors = dict.fromkeys(("simulation", "regression", "grid"), one)
    race = RaceScores("emilia-romagna-2024", 2024, 1, True, predictors, ())
    result = Backtest("hindsight", (2022, 2023), 2024, 1000, 0, "safety-cars", (race,) * 3, predictors, predictors, {})
    return [summary_table(result), races_table(result)]


def generalised(bahrain: RaceRecord) -> list[Shown]:
    return [*study_tables(from_plain(study(held_out=True, cars=True, name="a-model-of-three-tracks"), StudyResult))]


def other_rivals(bahrain: RaceRecord) -> list[Shown]:
    document = robustness()
    names = ["heuristic", "best-plan-sc", "planner", "imitation"]
    rows = [row | {"against": [row["against"][0] | {"strategist": name} for name in names]} for row in document["rows"]]
    return [robustness_table(bahrain, "HAM", names, list(from_plain(document | {"rows": rows}, Robustness).rows))]


def goals(bahrain: RaceRecord) -> list[Shown]:
    return [goals_table([one.document() for one in judge(GOALS, {})], "all, HAM at bahrain-2023")]


BUILDERS: Final[tuple[Callable[[RaceRecord], list[Shown]], ...]] = (
    leaderboard, seeds, cars, plans, overview, backtest, generalised, other_rivals, goals,
)  # fmt: skip


def printed(monkeypatch: pytest.MonkeyPatch, shown: list[Shown], width: int, *, encoding: str = "utf-8", wide: bool = False) -> str:
    """What a command prints of its tables to a file of an encoding, at a width."""
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding, write_through=True)
    monkeypatch.setenv("COLUMNS", str(width))
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", stream)
        Output(as_json=False, wide=wide).result({}, *shown)
    return raw.getvalue().decode(encoding)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("build", BUILDERS)
def test_every_table_fits_and_nothing_is_cut(
    bahrain: RaceRecord, monkeypatch: pytest.MonkeyPatch, build: Callable[[RaceRecord], list[Shown]], width: int
) -> None:
    for one in build(bahrain):
        assert isinstance(one, FittedTable)
        text = printed(monkeypatch, [one], width)
        assert not ELLIPSIS.search(text)
        assert max(len(line) for line in text.splitlines()) <= width
        numbers = [cell for row in one.rows for cell, column in zip(row, one.columns, strict=True) if not (column.words or column.priority)]
        for cell in numbers:
            for line in cell.plain.split("\n"):
                assert line in text, f"{line!r} is broken at {width}"


@pytest.mark.parametrize("width", WIDTHS)
def test_the_list_of_races_fits(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    assert main(["races"]) == 0
    text = capsys.readouterr().out
    assert not ELLIPSIS.search(text)
    assert max(len(line) for line in text.splitlines()) <= width
    assert all(name in text for name in ("united-states-2022", "Emilia Romagna Grand Prix", "default"))


BRACKETS: Final = "runs/[x]/[bold]/[/dim]"


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_brackets_in_names_are_no_markup(bahrain: RaceRecord, monkeypatch: pytest.MonkeyPatch, encoding: str) -> None:
    row = leaderboard_rows(BRACKETS, "dp")
    shown: list[Shown] = [
        leaderboard_table(bahrain, row, BRACKETS),
        leaderboard_table(bahrain, row, "dp"),
        table(f"Runs in {BRACKETS}", ["folder", Column(BRACKETS, words=True)], [(BRACKETS, BRACKETS)], captions=[BRACKETS]),
        f"Written to {BRACKETS}",
    ]
    text = printed(monkeypatch, shown, 200, encoding=encoding)
    assert text.count(BRACKETS) == 3 + 1 + 5 + 1
    assert f"{BRACKETS} <" in text, "the model is marked"


def test_brackets_in_labels_of_progress_are_no_markup(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    for show in (progress, steps):
        terminal = Terminal()
        monkeypatch.setattr(sys, "stderr", terminal)
        with show(Output(as_json=False), f"Calling {BRACKETS}") as task:
            if show is steps:
                task(BRACKETS)  # type: ignore[call-arg, arg-type]
        assert f"Calling {BRACKETS}" in terminal.getvalue()


def test_no_text_is_read_as_markup() -> None:
    """Styles are given as `Text`; names of folders and strategists may hold brackets."""
    modules = [path.read_text(encoding="utf-8") for path in Path(cli.__file__).parent.glob("*.py")]
    assert len(modules) > 20
    assert not [text for text in modules if "from_markup" in text or "rich.markup" in text]


def test_styles_stay_where_signs_are_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Text.assemble("a → ", ("b → ", "bold"), "c …")
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    assert "a -> \x1b[1mb -> \x1b[0mc ..." in printed(monkeypatch, [table("T", [""], [(cell,)])], 80, encoding="ascii")


def wide_table() -> FittedTable:
    columns: list[str | Column] = ["name", *(Column(f"figure number {i}", i) for i in range(12))]
    return table("Figures", columns, [("a", *("1.25",) * 12)], captions=["below"])


def test_columns_are_left_out_by_priority_and_named_and_wide_shows_all(monkeypatch: pytest.MonkeyPatch) -> None:
    narrow = printed(monkeypatch, [wide_table()], 80)
    heads = " ".join(narrow.split(LINE)[0].split())
    assert "0 1 2 3 4 5 6 7 8" in heads, "the head is wrapped, its number stands in the last line"
    left_out = "Left out at this width: figure number 9, figure number 10, figure number 11"
    assert left_out in " ".join(narrow.split())
    assert "--wide shows every column" in " ".join(narrow.split())
    wide = printed(monkeypatch, [wide_table()], 80, wide=True)
    assert "Left out" not in wide
    assert all(f"figure number {i}" in wide for i in range(12))


def test_what_must_be_shown_is_folded_where_nothing_else_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    text = printed(monkeypatch, [table("Where", ("", ""), [("page", "a/very/long/path/that/no/terminal/holds" * 4)])], 40)
    assert not ELLIPSIS.search(text)
    assert "".join(text.replace("page", "").split()).endswith("a/very/long/path/that/no/terminal/holds" * 4)
    assert max(len(line) for line in text.splitlines()) <= 40


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "cp437", "latin-1"])
@pytest.mark.parametrize("build", BUILDERS)
def test_tables_have_plain_signs_where_the_stream_has_no_others(
    bahrain: RaceRecord, monkeypatch: pytest.MonkeyPatch, build: Callable[[RaceRecord], list[Shown]], encoding: str
) -> None:
    text = printed(monkeypatch, [*build(bahrain), "−1.5 → São Paulo…"], 80, encoding=encoding)
    assert "?" not in text
    assert max(len(line) for line in text.splitlines()) <= 80
    assert text.rstrip().splitlines()[-1].startswith("-1.5 -> S")


@pytest.mark.parametrize(
    ("encoding", "plain"),
    [("ascii", "Sao Paulo: -1.0 +- 0.2 -> ##=="), ("cp1252", "São Paulo: -1.0 ± 0.2 -> ##=="), ("utf-8", "São Paulo: −1.0 ± 0.2 → ██━━")],
)
def test_a_sign_is_replaced_only_where_it_must_be(encoding: str, plain: str) -> None:
    assert plain_signs("São Paulo: −1.0 ± 0.2 → ██━━", encoding) == plain
    assert plain_signs("日", "ascii") == "?"
