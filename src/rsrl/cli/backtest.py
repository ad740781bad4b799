"""`rsrl backtest`: real races predicted from the races before them, and how wrong that was."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import ForceOption, JsonOption, LapsOption, SeedOption, parse_seasons
from rsrl.cli.output import Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance

if TYPE_CHECKING:
    from rsrl.evaluation.backtest import Backtest, RaceScores

FactsOption = Annotated[
    Path | None, typer.Option("--facts", metavar="DIR", help="Folder with results and qualifying; else grid and result come from the laps.")
]
FitOption = Annotated[str, typer.Option("--fit", metavar="A,B", help="Seasons to learn from, all before the test season.")]
TestOption = Annotated[int, typer.Option("--test", metavar="SEASON", help="Season to predict, race by race.")]
ModeOption = Annotated[str, typer.Option("--mode", metavar="MODE", help="forecast, replay or hindsight.")]
RacesOption = Annotated[int, typer.Option("--races", metavar="N", help="Simulated races for each real one.")]
WithoutOption = Annotated[
    str | None, typer.Option("--without", metavar="PART", help="Take a part out of the simulator: traffic, safety-cars or wear.")
]
OutOption = Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write the result as JSON to this file too.")]

SHOWN = ("mae_position", "mae_rank_classified", "spearman", "brier_points", "mae_green_lap_s", "stops_mae", "first_stop_within_3")
HEADS = ("position", "rank", "Spearman", "Brier", "green lap, s", "stops", "1st stop +-3")


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
    json: JsonOption = False,
) -> None:
    """Predict every race of a season from the races before it, and score that.

    Each race is predicted from the seasons of --fit, the earlier rounds of its
    own season, and its own grid and qualifying.

    forecast   nothing more; rivals decide for themselves, incidents are drawn
    replay     every stop, safety car and retirement as it was; pace is still the forecast
    hindsight  replay, with each car's pace from the race itself

    Errors are in places, over every starter; `rank` compares ranks among the
    classified. Baselines: `grid`, finish where you start, and `regression`, a
    ridge regression on what was known before the race.

    [bold]Examples[/bold]

    rsrl backtest --laps laps --facts facts --fit 2022,2023 --test 2024
    rsrl backtest --laps laps --facts facts --mode hindsight --without traffic --json
    """
    from rsrl.evaluation.backtest import check_request, read_season, run_backtest

    output = Output(json)
    seasons = parse_seasons("--fit", fit)
    check_request(mode, seasons, test, races, without)
    if out:
        refuse_overwrite(out, force)
        make_folder(out.parent)
    with progress(output, "analysing races") as report:
        season = read_season(laps, facts, seasons, test, report)
    with progress(output, f"predicting {test}") as report:
        result = run_backtest(season, mode, races=races, seed=seed, left_out=without, progress=lambda _, done, total: report(done, total))
    content = as_json(result, seed)
    if out:
        write_json(out, content)
    output.result(content, _summary(result), _by_race(result))


def as_json(result: "Backtest", seed: int) -> dict[str, Any]:
    """The result as plain types: `overall` and `baselines` over the dry races, `all_races` over all of them, `races` one by one."""
    return {
        "mode": result.mode,
        "fit": list(result.fit),
        "test": result.test,
        "simulated_races": result.simulated_races,
        "without": result.left_out,
        "overall": _with_difference(result.overall, result.against_grid, "simulation"),
        "baselines": {name: _with_difference(result.overall, result.against_grid, name) for name in ("grid", "regression")},
        "all_races": {
            **result.all_races.get("simulation", {"races": 0}),
            **{name: dict(result.all_races.get(name, {"races": 0})) for name in ("grid", "regression")},
        },
        "races": [_race(r) for r in result.races],
        "provenance": provenance(seed),
    }


def _with_difference(overall: Mapping[str, Any], against: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {**overall.get(name, {"races": 0}), "difference_to_grid": dict(against.get(name, {}))}


def _race(race: "RaceScores") -> dict[str, Any]:
    return {
        "race": race.name,
        "season": race.season,
        "round": race.round,
        "wet": race.wet,
        **race.scores["simulation"],
        "grid": dict(race.scores["grid"]),
        "regression": dict(race.scores["regression"]),
        "cars": [car._asdict() for car in race.cars],
    }


def _summary(result: "Backtest") -> Table:
    rows = []
    for name in ("simulation", "regression", "grid"):
        scores = result.overall.get(name, {})
        gap = result.against_grid.get(name, {}).get("mae_position")
        interval = f"{gap['mean']:+.2f} [{gap['low']:+.2f}, {gap['high']:+.2f}]" if gap else ""
        rows.append([name, *(_number(scores.get(m)) for m in SHOWN), interval])
    taken = f", without {result.left_out}" if result.left_out else ""
    dry = sum(not r.wet for r in result.races)
    title = f"{result.mode} of {result.test}{taken}: {dry} dry races, {result.simulated_races} simulated races each"
    return table(title, ("", *HEADS, "position less grid's"), rows)


def _by_race(result: "Backtest") -> Table:
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
