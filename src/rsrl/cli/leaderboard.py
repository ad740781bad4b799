"""What `evaluate` and `demo` share: strategists on the same races, the leaderboard, the result files."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace
from rich.text import Text

from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.output import Column, FittedTable, Output, table
from rsrl.cli.progress import progress
from rsrl.results import CommonStrategy, Evaluation, Row, half_width
from rsrl.season import RaceRecord

if TYPE_CHECKING:
    from rsrl.drawing import StintBar
    from rsrl.evaluation import RaceLog
    from rsrl.strategists import Strategist

DEFAULT_STRATEGISTS = "fixed,heuristic,dp,best-plan,best-plan-sc"
FILES = ("evaluation.json", "positions.png", "strategies.png")


class CalledRaces(NamedTuple):
    """Races that all strategists call: races number first, first + 1 ... of a seed, for one car."""

    record: RaceRecord
    car: int
    seed: int
    races: int
    first: int = 0


def run_all(output: Output, policies: "Sequence[Strategist]", names: Sequence[str], called: CalledRaces) -> "list[RaceLog]":
    """Call the same races by the policies, then by each strategist named; a name may be the folder of another model."""
    from rsrl.evaluation import run_races
    from rsrl.strategists import STRATEGISTS, Strategist, make_model_strategist, make_strategist

    record, car, seed, races, first = called
    models: dict[str, Strategist] = {policy.name: policy for policy in policies}
    own = list(models)
    for name in names:
        if name not in STRATEGISTS:
            models[name] = make_model_strategist(name, record, {m.name for m in models.values()})
    logs = []
    for name in (*own, *names):
        with progress(output, f"Calling {races:,} races: {name}") as report:
            strategist = models.get(name) or make_strategist(name, record, car, progress=report)
            logs.append(run_races(strategist, record, car, seed, races, first_race=first, progress=report))
    return logs


def result_files(out: Path | None, force: bool) -> dict[str, Path]:
    """Paths of the result files by name, none without a folder; raises RsrlError where one exists or cannot be written."""
    if out is None:
        return {}
    make_folder(out)
    for name in FILES:
        refuse_overwrite(out / name, force)
    return {name: out / name for name in FILES}


def write_results(paths: dict[str, Path], result: Evaluation, logs: "list[RaceLog]", record: RaceRecord) -> Evaluation:
    """Write the result with the strategies driven, and the figures; returns it as written."""
    from rsrl.evaluation import common_strategies, plot_positions

    common = tuple(strategy for log in logs for strategy in common_strategies(log))
    written = replace(result, files=tuple(str(path) for path in paths.values()), strategies=common)
    write_json(paths["evaluation.json"], written)
    where = f"{record.event} {record.season}, {result.driver}"
    plot_positions(logs, f"Finishing positions: {where}, {result.races:,} races", paths["positions.png"])
    draw_strategies(common, record, result.driver, paths["strategies.png"])
    return written


def draw_strategies(common: Sequence[CommonStrategy], record: RaceRecord, driver: str, path: Path) -> None:
    """Draw the strategies that each strategist drove most often."""
    from rsrl.drawing import plot_strategies

    title = f"Strategies driven: {record.event} {record.season}, {driver}"
    plot_strategies(_bars(common), record.laps, title, "10-90 % of stops", path)


def _bars(common: Sequence[CommonStrategy]) -> "list[StintBar]":
    from rsrl.drawing import StintBar

    return [
        StintBar(s.plan, f"{100 * s.share:.0f} %  P{s.mean_position:.1f}", s.compounds, s.laps, s.windows, s.strategist) for s in common
    ]


def leaderboard_table(record: RaceRecord, result: Evaluation, model: str) -> FittedTable:
    """The leaderboard as people read it; the row named `model`, with which all are compared, is marked."""
    rows = result.rows
    gap = (Column("gap %", 3), Column("+-", 4)) if any(row.gap_closed is not None for row in rows) else ()
    columns = (
        Column("strategist", words=True), "position", Column("+-", 1), "behind", "+-", "ahead %", *gap,
        Column("points", 5), Column("stops", 2), Column("invalid %", 7), Column("out %", 6), Column("ms", 8),
    )  # fmt: skip
    cells = [
        (
            Text(f"{row.strategist} <", "bold") if row.strategist == model else row.strategist,
            f"{row.mean_position:.2f}",
            f"{half_width(row.mean_position, row.ci95):.2f}",
            *(("", "", "") if row.strategist == model else _difference(row)),
            *_gap_closed(row),
            f"{row.mean_points:.2f}",
            f"{row.mean_stops:.2f}",
            f"{100 * row.invalid_share:.1f}",
            f"{100 * row.retired_share:.1f}",
            f"{row.decision_ms:.3f}",
        )
        for row in rows
    ]
    title = f"{result.driver}, {record.event} {record.season}: {result.races:,} races of seed {result.seed}, the same for all"
    captions = [
        f"behind: places behind {model} on the same race; ahead: races {model} finishes ahead, ties half; +-: half the 95 % interval",
    ]
    if gap:
        captions.append("gap: share of the way from fixed strategies to hindsight, which knows each race, so nobody reaches 100 %")
    return table(title, columns, cells, captions=captions)


def _difference(row: Row) -> tuple[str, str, str]:
    return f"{row.difference:+.2f}", f"{half_width(row.difference, row.difference_ci95):.2f}", f"{100 * row.p_better:.0f}"


def _gap_closed(row: Row) -> tuple[str, ...]:
    if row.gap_closed is None:
        return ()
    return f"{100 * row.gap_closed:.0f}", f"{100 * half_width(row.gap_closed, row.gap_closed_ci95):.0f}"
