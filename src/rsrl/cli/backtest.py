"""`rsrl backtest`: real races predicted from the races before them, and the errors of the predictions."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import ForceOption, JsonOption, LapsOption, SeedOption, WideOption, parse_seasons
from rsrl.cli.output import Column, FittedTable, Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.results import AllRaces, Averages, BacktestRace, BacktestResult, Baselines, Measures, Overall

if TYPE_CHECKING:
    from rsrl.evaluation.backtest import Backtest, RaceScores, Season

FactsOption = Annotated[
    Path | None, typer.Option("--facts", metavar="DIR", help="Folder with results and qualifying; else grid and result come from the laps.")
]
FitOption = Annotated[str, typer.Option("--fit", metavar="A,B", help="Seasons to learn from, all before the test season.")]
TestOption = Annotated[int, typer.Option("--test", metavar="SEASON", help="Season to predict, race by race.")]
ModeOption = Annotated[str, typer.Option("--mode", metavar="MODE", help="forecast, replay, hindsight or plans.")]
RacesOption = Annotated[int, typer.Option("--races", metavar="N", help="Simulated races for each real one.")]
WithoutOption = Annotated[
    str | None, typer.Option("--without", metavar="PART", help="Take a part out of the simulator: traffic, safety-cars or wear.")
]
OutOption = Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write the result as JSON to this file too.")]

SHOWN = ("mae_position", "mae_rank_classified", "spearman", "brier_points", "mae_green_lap_s", "stops_mae", "first_stop_within_3")
HEADS = (
    "position", Column("rank", 1), "Spearman", Column("Brier", 2), Column("green lap, s", 3), Column("stops", 5),
    Column("1st stop +-3", 4),
)  # fmt: skip


def command(
    laps: LapsOption,
    facts: FactsOption = None,
    fit: FitOption = "2022,2023",
    test: TestOption = 2024,
    mode: ModeOption = "forecast",
    races: RacesOption = 1000,
    seed: SeedOption = 0,
    without: WithoutOption = None,
    out: OutOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Predict every race of a season from the races before it, and score that.

    Each race is predicted from the seasons of --fit, the earlier rounds of its
    own season, and its own grid and qualifying.

    forecast   nothing more; rivals' stops and incidents are simulated
    replay     stops, safety cars and retirements as they were; forecast pace
    hindsight  replay, with each car's pace from the race itself
    plans      the best plans of the simulated race beside those that were run

    Errors are in places, over every starter; `rank` compares ranks among the
    classified. Baselines: `grid`, finish where you start, and `regression`, a
    median regression on what was known before the race.

    [bold]Examples[/bold]

    rsrl backtest --laps laps --facts facts --fit 2022,2023 --test 2024
    rsrl backtest --laps laps --facts facts --mode hindsight --without traffic --json
    """
    from rsrl.evaluation.backtest import check_request, read_season, run_backtest

    output = Output(json, wide)
    seasons = parse_seasons("--fit", fit)
    check_request(mode, seasons, test, races, without)
    if out:
        refuse_overwrite(out, force)
        make_folder(out.parent)
    with progress(output, "analysing races") as report:
        season = read_season(laps, facts, seasons, test, report)
    if mode == "plans":
        _plans(output, season, races, seed, out)
        return
    with progress(output, f"predicting {test}") as report:
        result = run_backtest(season, mode, races=races, seed=seed, left_out=without, progress=lambda _, done, total: report(done, total))
    content = document(result, seed)
    if out:
        write_json(out, content)
    output.result(content, summary_table(result), races_table(result))


def _plans(output: Output, season: "Season", races: int, seed: int, out: Path | None) -> None:
    from rsrl.cli import backtest_plans
    from rsrl.evaluation.backtest import run_plans

    with progress(output, f"ranking plans of {season.test}") as report:
        found = run_plans(season, races=races, seed=seed, progress=lambda _, done, total: report(done, total))
    content = backtest_plans.document(found, seed)
    if out:
        write_json(out, content)
    output.result(content, backtest_plans.summary_table(found), backtest_plans.races_table(found))


def document(result: "Backtest", seed: int) -> BacktestResult:
    """The result as it is written: `overall` and `baselines` over the dry races, `all_races` over all of them, `races` one by one."""
    dry = {name: _overall(result, name) for name in ("simulation", "grid", "regression")}
    every = {name: _means(result.all_races.get(name)) for name in ("simulation", "grid", "regression")}
    return BacktestResult(
        mode=result.mode,
        fit=result.fit,
        test=result.test,
        simulated_races=result.simulated_races,
        without=result.left_out,
        overall=dry["simulation"],
        baselines=Baselines(dry["grid"], dry["regression"]),
        all_races=AllRaces(**every["simulation"], grid=Averages(**every["grid"]), regression=Averages(**every["regression"])),
        races=tuple(_race(race) for race in result.races),
        provenance=provenance(seed),
    )


def _overall(result: "Backtest", name: str) -> Overall:
    return Overall(**_means(result.overall.get(name)), difference_to_grid=dict(result.against_grid.get(name, {})))


def _means(means: Mapping[str, float] | None) -> dict[str, Any]:
    """Means of all measures; None of each where there are no races."""
    return dict(means) if means else dict.fromkeys(Averages.__struct_fields__) | {"races": 0}


def _race(race: "RaceScores") -> BacktestRace:
    grid, regression = (Measures(**race.scores[name]) for name in ("grid", "regression"))
    return BacktestRace(
        **race.scores["simulation"],
        race=race.name,
        season=race.season,
        round=race.round,
        wet=race.wet,
        grid=grid,
        regression=regression,
        cars=race.cars,
    )


def summary_table(result: "Backtest") -> FittedTable:
    """Mean scores over the dry races: the simulation and the two baselines."""
    rows = []
    for name in ("simulation", "regression", "grid"):
        scores = result.overall.get(name, {})
        gap = result.against_grid.get(name, {}).get("mae_position")
        interval = f"{gap.mean:+.2f} [{gap.low:+.2f}, {gap.high:+.2f}]" if gap else ""
        rows.append([name, *(_number(scores.get(m)) for m in SHOWN), interval])
    taken = f", without {result.left_out}" if result.left_out else ""
    dry = sum(not r.wet for r in result.races)
    title = f"{result.mode} of {result.test}{taken}: {dry} dry races, {result.simulated_races} simulated races each"
    return table(title, ("", *HEADS, "position less grid's"), rows)


def races_table(result: "Backtest") -> FittedTable:
    """Scores of the simulation race by race, and the position errors of the baselines."""
    rows = []
    for race in result.races:
        own, grid, regression = (race.scores[n] for n in ("simulation", "grid", "regression"))
        cells = [_number(own[m]) for m in SHOWN]
        rows.append(
            [race.name + (" (wet)" if race.wet else ""), *cells, _number(regression["mae_position"]), _number(grid["mae_position"])]
        )
    return table("Race by race", ("", *HEADS, "regression", "grid"), rows)


def _number(value: float | None) -> str:
    return "-" if value is None or value != value else f"{value:.3f}" if abs(value) < 1 else f"{value:.2f}"
