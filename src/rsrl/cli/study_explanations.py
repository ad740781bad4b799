"""`rsrl study explanations`: the fidelity of each explanation method, beside the paper's figures."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from rich.text import Text

from rsrl.cli.explain_options import METHODS
from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import DriverOption, ForceOption, JsonOption, ModelArgument, OutFolderOption, SeedOption, WideOption
from rsrl.cli.output import Column, FittedTable, Output, table
from rsrl.cli.progress import Report, progress
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.results import ExplanationStudy, JudgedGoal

if TYPE_CHECKING:
    from rsrl.cli.explain_scenario import Scenario

RESULT_FILE: Final = "explanations.json"
DEFAULT_RACE: Final = "bahrain-2023"
MEASURED: Final = ("attribution", "tree", "counterfactual", "what-if", "all")
TIMED_LAPS: Final = (10, 20, 30)
"""Laps on which all methods are run together and timed."""

RaceOption = Annotated[str, typer.Option("--race", metavar="RACE", help="The race whose decisions are explained.")]
RacesOption = Annotated[int, typer.Option("--races", metavar="N", min=2, max=100_000, help="Races from which decisions are drawn.")]
DrivingOption = Annotated[int, typer.Option("--driving-races", metavar="N", min=2, max=1_000_000, help="Races that the tree calls itself.")]
MethodOption = Annotated[str | None, typer.Option("--method", metavar="A,B", help=f"Only some of {', '.join(MEASURED)}.")]


def command(
    model: ModelArgument = "all",
    race: RaceOption = DEFAULT_RACE,
    driver: DriverOption = None,
    races: RacesOption = 100,
    driving_races: DrivingOption = 1920,
    method: MethodOption = None,
    seed: SeedOption = 702_113,
    out: OutFolderOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Measure every way of explaining against the policy itself.

    Attribution: run time and the error of sampled values. Tree: its calls,
    and the races it drives itself. Counterfactual: how many decisions have
    one, and how many causes it changes. What-if: run time, and the coverage
    of its intervals. Each figure stands beside the paper's and the goal set
    for it, met or missed.

    Some figures hold by construction and only check the code: Shapley values
    of few players are exact and add up, and a counterfactual that the policy
    does not confirm is not shown. They are marked as such.

    [bold]Examples[/bold]

    rsrl study explanations
    rsrl study explanations bahrain-2023 --races 200 --out runs/explanations
    rsrl study explanations --method attribution,tree --json
    """
    from rsrl.cli.explain_scenario import find_scenario
    from rsrl.explanation.fidelity.goals import GOALS, judge

    output = Output(json, wide)
    wanted = _wanted(method)
    if out is not None:
        refuse_overwrite(make_folder(out) / RESULT_FILE, force)
    scenario = find_scenario(model, race, driver, None, None, seed, 0)
    figures = {}
    for name in wanted:
        with progress(output, f"Measuring {name}") as report:
            figures[name] = MAKERS[name](scenario, driving_races if name == "tree" else races, report)
    judged = [one.document() for one in judge([goal for goal in GOALS if goal.method in wanted], figures)]
    result = ExplanationStudy(
        model=model,
        model_hash=scenario.policy.hash,
        race=scenario.record.name,
        driver=scenario.record.cars[scenario.car].driver,
        races=races,
        goals=tuple(JudgedGoal(**goal) for goal in judged),
        figures=figures,
        provenance=provenance(seed),
    )
    if out is not None:
        write_json(out / RESULT_FILE, result)
    output.result(result, goals_table(judged, f"{model}, {result.driver} at {scenario.record.name}"))


def _wanted(text: str | None) -> tuple[str, ...]:
    words = set(MEASURED) if text is None else {word.strip() for word in text.split(",") if word.strip()}
    if unknown := sorted(words - set(MEASURED)):
        raise RsrlError(f"unknown --method {unknown[0]!r}; there are {', '.join(MEASURED)}")
    return tuple(name for name in MEASURED if name in words)


def goals_table(judged: list[dict[str, Any]], title: str) -> FittedTable:
    """Figures beside the paper's and the goals, the missed ones included."""
    rows = []
    for one in judged:
        held = "by construction" if one["by_construction"] else "met"
        verdict = {True: held, False: Text("MISSED", "bold"), None: one["why"]}[one["met"]]
        bound = "" if one["bound"] is None else f"{one['relation']} {one['bound']:.3g}"
        value = "-" if one["value"] is None else f"{one['value']:.3g}"
        rows.append((one["method"], one["what"], one["paper"], value, bound, verdict))
    columns = (
        Column("method", 1),
        Column("figure", words=True),
        Column("the paper", 2, words=True),
        "here",
        "goal",
        Column("", words=True),
    )
    constructed = sum(one["met"] is True and one["by_construction"] for one in judged)
    met = sum(one["met"] is True for one in judged) - constructed
    missed, open_ = (sum(one["met"] is verdict for one in judged) for verdict in (False, None))
    caption = f"{met} met, {missed} missed, {constructed} by construction, {open_} not judged"
    return table(f"Explanations measured: {title}", columns, rows, captions=[caption])


def _attribution(scenario: "Scenario", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_attribution

    return measure_attribution(scenario.own, scenario.record, scenario.car, races, scenario.seed, report)


def _tree(scenario: "Scenario", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_tree
    from rsrl.explanation.tree.store import find_tree

    tree = find_tree(scenario.own, scenario.record, scenario.car)
    return measure_tree(scenario.own, scenario.record, tree=tree, car=scenario.car, races=races, seed=scenario.seed, progress=report)


def _counterfactual(scenario: "Scenario", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_counterfactual
    from rsrl.explanation.tree.store import find_tree

    tree = find_tree(scenario.own, scenario.record, scenario.car)
    return measure_counterfactual(
        scenario.own, scenario.record, tree=tree, car=scenario.car, races=races, seed=scenario.seed, progress=report
    )


def _what_if(scenario: "Scenario", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_what_if

    return measure_what_if(scenario.own, [scenario.record], seed=scenario.seed, progress=report)


def _everything(scenario: "Scenario", races: int, report: Report) -> dict[str, Any]:
    """Time of all methods together on a few laps, each of another race; the first is run once before, so that kernels are compiled."""
    import statistics

    from rsrl.cli.explain_run import Request, run
    from rsrl.explanation import record_episode

    quiet, request = Output(True), Request(METHODS, every=True)
    drives = (record_episode(scenario.own, scenario.record, scenario.car, seed=scenario.seed, race=number) for number in range(races))
    driven = [one for one in drives if one.laps >= max(TIMED_LAPS)][: len(TIMED_LAPS)]
    moments = [one.moment(lap) for one, lap in zip(driven, TIMED_LAPS, strict=False)]
    if not moments:
        raise RsrlError(f"none of {races} races lasts to lap {max(TIMED_LAPS)}; give more --races")
    seconds, parts = [], []
    for done, moment in enumerate([moments[0], *moments]):
        started = time.perf_counter()
        document = run(scenario._replace(moment=moment, race=moment.race or 0), request, quiet)
        seconds.append(time.perf_counter() - started)
        parts.append(document["seconds"])
        report(done + 1, len(moments) + 1)
    return {
        "laps": list(TIMED_LAPS),
        "seconds": {"median": statistics.median(seconds[1:]), "largest": max(seconds[1:]), "first": seconds[0]},
        "by_method": parts[1:],
    }


MAKERS: Final[dict[str, Callable[["Scenario", int, Report], dict[str, Any]]]] = {
    "attribution": _attribution,
    "tree": _tree,
    "counterfactual": _counterfactual,
    "what-if": _what_if,
    "all": _everything,
}
