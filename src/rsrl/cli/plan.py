"""`rsrl plan`: searches for the best plans before the race."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from rsrl.cli.files import make_folder, refuse_overwrite
from rsrl.cli.options import (
    DriverOption,
    ForceOption,
    JsonOption,
    OutFolderOption,
    RaceArgument,
    SeedOption,
    SetOption,
    SetsOption,
    WideOption,
    assumed,
)
from rsrl.cli.output import Column, FittedTable, Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.season import COMPOUND_NAMES, COMPOUNDS, RaceRecord, c_numbers, find_car, load_race, read_compound

if TYPE_CHECKING:
    from rsrl.strategists import PlanSearchResult, RankedPlan

STYLES = ("bold red", "bold yellow", "bold")
FIGURE = "plans.png"
MAX_ROWS = 6
WINDOW_SHARE = 0.006
"""Races for each lap of a pit window, as a share of the races of the search: 1,200 by default."""

MIN_WINDOW_RACES = 40

StartOption = Annotated[str | None, typer.Option("--start", metavar="S|M|H", help="Starting tyre. Default: all are compared.")]
BudgetOption = Annotated[
    int,
    typer.Option(
        "--races", metavar="N", min=1, max=100_000_000, help="Approximate number of races to simulate. More races separate closer plans."
    ),
]
RuleOption = Annotated[
    bool, typer.Option("--sc-rule", help="Allow stops to be brought forward under a safety car, and search for the best rule.")
]


def command(
    race: RaceArgument,
    driver: DriverOption = None,
    start: StartOption = None,
    races: BudgetOption = 200_000,
    sc_rule: RuleOption = False,
    changes: SetOption = None,
    sets: SetsOption = None,
    seed: SeedOption = 0,
    out: OutFolderOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Search for the best pit stop plans of a race.

    All legal plans with one to three stops are ranked by their time on an
    empty track. The promising ones are simulated against the field, the
    better ones in more races. The table shows the best plan of each sequence
    of compounds: its mean position, how many places it is behind the best
    plan on the same races, the probability that it is the best of those
    shown, and its pit windows, within which moving a stop costs less than
    0.05 places. With --out the plans are drawn in plans.png.

    The plan S-H@14-S@36 means: start on soft, box for hard at the end of
    lap 14 and for soft at the end of lap 36 (S soft, M medium, H hard).

    [bold]Examples[/bold]

    rsrl plan bahrain-2023
    rsrl plan bahrain-2023 --driver ALO --start S --out plans
    rsrl plan bahrain-2023 --sc-rule --races 400000 --json
    rsrl plan bahrain-2023 --set wear.S=x1.2 --set sc_chance=0
    """
    output = Output(json, wide)
    record = assumed(load_race(race), changes, sets)
    car = find_car(record, driver)
    code = _start_code(start, record, car)
    if out is not None:
        make_folder(out)
        refuse_overwrite(out / FIGURE, force)
    search, rows, simulated = _search(output, record, car, code, races, sc_rule, seed)
    name = record.cars[car].driver
    result: dict[str, Any] = {
        "race": record.name,
        "driver": name,
        "start": None if code is None else COMPOUNDS[code],
        "sc_rule": sc_rule,
        "seed": seed,
        "legal_plans": search.legal_plans,
        "races": simulated,
        "final_races": search.final_races,
        "plans": rows,
        "provenance": provenance(seed),
    }
    if out is not None:
        _draw(rows, record, name, out / FIGURE)
        result["figure"] = out / FIGURE
    output.result(result, plans_table(_title(search, record, name), rows, record.laps, sc_rule))


def _search(
    output: Output, record: RaceRecord, car: int, start: int | None, races: int, sc_rule: bool, seed: int
) -> "tuple[PlanSearchResult, list[dict[str, Any]], int]":
    """The search, its best plans with their pit windows as rows of the result, and the number of races simulated."""
    from rsrl.strategists import pit_windows, search_plans, window_budget

    with progress(output, f"Searching the plans of {record.cars[car].driver} for {record.event} {record.season}") as report:
        search = search_plans(record, car, start, seed=seed, budget=races, sc_rule=sc_rule, progress=report)
    ranked = search.by_compounds[:MAX_ROWS]
    plans = [entry.plan for entry in ranked]
    window_races = max(round(races * WINDOW_SHARE), MIN_WINDOW_RACES)
    with progress(output, "Finding the pit windows of the best plans") as report:
        windows = pit_windows(record, car, plans, seed=seed, races=window_races, progress=report)
    rows = [_row(entry, w) for entry, w in zip(ranked, windows, strict=True)]
    return search, rows, search.races + window_budget(plans, window_races)


def _start_code(start: str | None, record: RaceRecord, car: int) -> int | None:
    if start is None:
        return None
    letter = read_compound(start, record.tyres)
    if letter is None:
        raise RsrlError(f"--start {start!r}: unknown compound; compounds are {', '.join(COMPOUNDS)} ({c_numbers(record.tyres)})")
    code = COMPOUNDS.index(letter)
    if not record.sets_of(car)[code]:
        raise RsrlError(f"--start {letter}: {record.cars[car].driver} has no set of {COMPOUND_NAMES[code]} at {record.name}")
    return code


def _row(entry: "RankedPlan", windows: tuple[tuple[int, int], ...]) -> dict[str, Any]:
    plan = entry.plan
    return {
        "plan": str(plan),
        "start": COMPOUNDS[plan.compounds[0]],
        "stops": [
            {"lap": lap, "compound": COMPOUNDS[compound], "window": list(window)}
            for lap, compound, window in zip(plan.laps, plan.compounds[1:], windows, strict=True)
        ],
        "sc_window_laps": plan.sc_window_laps,
        "vsc_window_laps": plan.vsc_window_laps,
        "mean_position": entry.mean_position,
        "ci95": list(entry.position_ci95),
        "behind_best": entry.behind_best,
        "behind_best_ci95": list(entry.behind_best_ci95),
        "mean_points": entry.mean_points,
        "mean_points_ci95": list(entry.points_ci95),
        "p_best": entry.p_best,
        "clean_air_loss_s": entry.clean_air_loss_s,
    }


def _title(search: "PlanSearchResult", record: RaceRecord, driver: str) -> str:
    return (
        f"Best plans of {driver}, {record.event} {record.season}: {search.legal_plans:,} legal plans, {search.races:,} races searched, "
        f"{search.final_races:,} races each to compare"
    )


def plans_table(title: str, rows: list[dict[str, Any]], laps: int, sc_rule: bool) -> FittedTable:
    """The best plans, each with its stints drawn to scale."""
    columns = (
        Column("plan", words=True), "stints and pit windows", "position", Column("+-", 4), "behind", Column("+-", 1), Column("points", 3),
        Column("best %", 2),
    )  # fmt: skip
    cells = []
    for row in rows:
        half = row["mean_position"] - row["ci95"][0]
        behind = row["behind_best_ci95"][1] - row["behind_best"]
        rule = f"\nSC {row['sc_window_laps']}, VSC {row['vsc_window_laps']} laps early" if sc_rule else ""
        best = (f"{row['behind_best']:.2f}", f"{behind:.2f}") if row is not rows[0] else ("", "")
        cells.append(
            (
                Text.assemble(row["plan"], (rule, "dim")),
                Text.assemble(_bar(row, laps), f"\n{_windows(row)}"),
                f"{row['mean_position']:.2f}",
                f"{half:.2f}",
                *best,
                f"{row['mean_points']:.2f}",
                f"{100 * row['p_best']:.0f}",
            )
        )
    return table(title, columns, cells, left=2)


def _bar(row: dict[str, Any], laps: int) -> Text:
    """A plan's stints as coloured bars, one character for two laps."""
    letters = [row["start"], *(stop["compound"] for stop in row["stops"])]
    edges = [0, *(stop["lap"] // 2 for stop in row["stops"]), laps // 2]
    parts = []
    for letter, begin, end in zip(letters, edges, edges[1:], strict=False):
        style = STYLES[COMPOUNDS.index(letter)]
        parts.append((f"{letter}{'━' * (max(end - begin, 2) - 1)}", style))
    return Text.assemble(*parts)


def _windows(row: dict[str, Any]) -> str:
    return "laps " + ", ".join("{}-{}".format(*stop["window"]) for stop in row["stops"])


def _draw(rows: list[dict[str, Any]], record: RaceRecord, driver: str, path: Path) -> None:
    from rsrl.drawing import StintBar, plot_strategies

    bars = [
        StintBar(
            label=row["plan"],
            note=f"P{row['mean_position']:.2f}",
            compounds=tuple(COMPOUNDS.index(c) for c in (row["start"], *(s["compound"] for s in row["stops"]))),
            laps=tuple(s["lap"] for s in row["stops"]),
            windows=[(s["window"][0], s["window"][1]) for s in row["stops"]],
        )
        for row in rows
    ]
    title = f"Best plans of {driver}, {record.event} {record.season}"
    plot_strategies(bars, record.laps, title, "pit window: under 0.05 places lost", path)
