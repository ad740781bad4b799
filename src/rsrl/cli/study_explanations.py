"""`rsrl study explanations`: how far each way of explaining can be trusted, beside the paper's figures."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from rsrl.cli.explain_options import METHODS
from rsrl.cli.files import make_folder, refuse_overwrite, write_json
from rsrl.cli.options import DriverOption, ForceOption, JsonOption, ModelArgument, OutFolderOption, SeedOption
from rsrl.cli.output import Output, table
from rsrl.cli.progress import Report, progress
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError

if TYPE_CHECKING:
    from rich.table import Table

    from rsrl.cli.explain_subject import Subject

RESULT_FILE: Final = "explanations.json"
DEFAULT_RACE: Final = "bahrain-2023"
MEASURED: Final = ("attribution", "tree", "counterfactual", "what-if", "all")
TIMED_LAPS: Final = (10, 20, 30)
"""Laps on which everything is made at once and timed."""

RaceOption = Annotated[str, typer.Option("--race", metavar="RACE", help="The race whose decisions are explained.")]
RacesOption = Annotated[int, typer.Option("--races", metavar="N", min=2, max=100_000, help="Races that decisions are drawn from.")]
DrivingOption = Annotated[int, typer.Option("--driving-races", metavar="N", min=2, max=1_000_000, help="Races the tree itself calls.")]
MethodOption = Annotated[str | None, typer.Option("--method", metavar="A,B", help=f"Some only of {', '.join(MEASURED)}.")]


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
    json: JsonOption = False,
) -> None:
    """Measure every way of explaining against the policy itself.

    Attribution: do shares add up, how long does it take, how good are
    estimates. Tree: its labels, and the races it drives. Counterfactual: how
    many are found and confirmed. What-if: time, and whether its intervals
    hold. Each figure stands beside the paper's and the goal set for it, met
    or missed.

    [bold]Examples[/bold]

    rsrl study explanations
    rsrl study explanations bahrain-2023 --races 200 --out runs/explanations
    rsrl study explanations --method attribution,tree --json
    """
    from rsrl.cli.explain_subject import find_subject
    from rsrl.explanation.fidelity.goals import judge
    from rsrl.explanation.goal_list import GOALS

    output = Output(json)
    wanted = _wanted(method)
    if out is not None:
        refuse_overwrite(make_folder(out) / RESULT_FILE, force)
    subject = find_subject(model, race, driver, None, None, seed, 0)
    figures = {}
    for name in wanted:
        with progress(output, f"Measuring {name}") as report:
            figures[name] = MAKERS[name](subject, driving_races if name == "tree" else races, report)
    judged = [one.document() for one in judge([goal for goal in GOALS if goal.method in wanted], figures)]
    result = {
        "model": model,
        "model_hash": subject.policy.hash,
        "race": subject.record.name,
        "driver": subject.record.cars[subject.car].driver,
        "races": races,
        "goals": judged,
        "figures": figures,
        "provenance": provenance(seed),
    }
    if out is not None:
        write_json(out / RESULT_FILE, result)
    output.result(result, goals_table(judged, f"{model}, {result['driver']} at {subject.record.name}"))


def _wanted(text: str | None) -> tuple[str, ...]:
    words = set(MEASURED) if text is None else {word.strip() for word in text.split(",") if word.strip()}
    if unknown := sorted(words - set(MEASURED)):
        raise RsrlError(f"unknown --method {unknown[0]!r}; there are {', '.join(MEASURED)}")
    return tuple(name for name in MEASURED if name in words)


def goals_table(judged: list[dict[str, Any]], title: str) -> "Table":
    """Figures beside the paper's and the goals; a goal that is missed stands there as such."""
    rows = []
    for one in judged:
        said = {True: "met", False: "[bold]MISSED[/bold]", None: one["why"]}[one["met"]]
        bound = "" if one["bound"] is None else f"{one['relation']} {one['bound']:.3g}"
        value = "-" if one["value"] is None else f"{one['value']:.3g}"
        rows.append((one["method"], one["what"], one["paper"], value, bound, said))
    built = table(f"Explanations measured: {title}", ("method", "figure", "the paper", "here", "goal", ""), rows, left=3)
    met = sum(one["met"] is True for one in judged)
    missed = sum(one["met"] is False for one in judged)
    built.caption, built.caption_justify = f"{met} met, {missed} missed, {len(judged) - met - missed} not judged", "left"
    return built


def _attribution(subject: "Subject", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_attribution

    return measure_attribution(subject.policy, subject.record, subject.car, races, subject.seed, report)


def _tree(subject: "Subject", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_tree
    from rsrl.explanation.tree.store import find_tree

    tree = find_tree(subject.policy, subject.record, subject.car)
    return measure_tree(subject.policy, subject.record, tree=tree, car=subject.car, races=races, seed=subject.seed, progress=report)


def _counterfactual(subject: "Subject", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_counterfactual
    from rsrl.explanation.tree.store import find_tree

    tree = find_tree(subject.policy, subject.record, subject.car)
    return measure_counterfactual(
        subject.policy, subject.record, tree=tree, car=subject.car, races=races, seed=subject.seed, progress=report
    )


def _what_if(subject: "Subject", races: int, report: Report) -> dict[str, Any]:
    from rsrl.explanation.fidelity import measure_what_if

    return measure_what_if(subject.policy, [subject.record], seed=subject.seed, progress=report)


def _everything(subject: "Subject", races: int, report: Report) -> dict[str, Any]:
    """Time of all methods together on a few laps, each of another race; the first is driven once before, to compile what must be."""
    import statistics

    from rsrl.cli.explain_run import Request, run
    from rsrl.explanation import drive

    quiet, request = Output(True), Request(METHODS, every=True)
    drives = (drive(subject.policy, subject.record, subject.car, seed=subject.seed, race=number) for number in range(races))
    driven = [one for one in drives if one.laps >= max(TIMED_LAPS)][: len(TIMED_LAPS)]
    moments = [one.moment(lap) for one, lap in zip(driven, TIMED_LAPS, strict=False)]
    if not moments:
        raise RsrlError(f"none of {races} races lasts to lap {max(TIMED_LAPS)}; give more --races")
    seconds, parts = [], []
    for done, moment in enumerate([moments[0], *moments]):
        started = time.perf_counter()
        document = run(subject._replace(moment=moment, race=moment.race or 0), request, quiet)
        seconds.append(time.perf_counter() - started)
        parts.append(document["seconds"])
        report(done + 1, len(moments) + 1)
    return {
        "laps": list(TIMED_LAPS),
        "seconds": {"median": statistics.median(seconds[1:]), "largest": max(seconds[1:]), "first": seconds[0]},
        "by_method": parts[1:],
    }


MAKERS: Final[dict[str, Callable[["Subject", int, Report], dict[str, Any]]]] = {
    "attribution": _attribution,
    "tree": _tree,
    "counterfactual": _counterfactual,
    "what-if": _what_if,
    "all": _everything,
}
