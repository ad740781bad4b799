"""What `rsrl explain` does: run each method on the scenario and collect one result."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from rsrl.cli.explain_options import TARGETS
from rsrl.cli.explain_scenario import Scenario
from rsrl.cli.output import Output
from rsrl.cli.progress import brief, progress
from rsrl.cli.provenance import assumptions
from rsrl.errors import RsrlError

if TYPE_CHECKING:
    from rsrl.explanation import Decision, Explanation, Moment

NEED_ALTERNATIVES: Final = ("attribution", "tree", "counterfactual")
"""Methods that compare the call with another legal one."""


SAFETY_CAR_SHARE: Final = 4
"""A what-if under a safety car uses the futures of the plain what-if divided by this."""


@dataclass(frozen=True)
class Request:
    """The options of the command, checked.

    Attributes:
        every: a method that is not possible here is noted instead of refused.
        asides: also the what-ifs under a safety car and the comparison with the paper.
    """

    methods: tuple[str, ...]
    level: str = "group"
    background: str = "lap-aligned"
    target: str | None = None
    norm: str = "l1"
    check: str = "consistent"
    races: int = 2000
    safety_car_table: bool = False
    fit_tree: bool = False
    tree: Path | None = None
    tree_page: Path | None = None
    every: bool = False
    asides: bool = True


def run(scenario: Scenario, request: Request, output: Output) -> dict[str, Any]:
    """The result of `rsrl explain --json` without its provenance.

    Raises:
        RsrlError: a method or another call that is not possible for this decision; raised before any work.
    """
    policy, moment = scenario.policy, scenario.moment
    by_policy, left_out = _of_policy(scenario, request)
    decision = policy.decide(moment) if moment else None
    methods, notes = _possible(scenario, replace(request, methods=by_policy), decision)
    notes = left_out + notes
    tree = _tree(scenario, request, methods, output, notes)
    made, seconds = _prepared(scenario, request, output)
    with brief(output, f"Explaining lap {moment.lap}" if moment else "Summarising the race") as step:
        for name in methods:
            if name == "tree" and tree is None:
                continue
            step(name)
            started = time.perf_counter()
            made.append(MAKERS[name](scenario, request, tree))
            if request.asides and name == "what-if" and decision is not None and decision.alternative:
                made += _if_safety_car(scenario, request)
            seconds[name] = round(time.perf_counter() - started, 3)
        step("warnings, and the comparison with the paper")
        warnings = _warnings(scenario)
        paper = _paper(scenario, made, tree) if request.asides else None
    return {
        "race": scenario.record.name,
        "driver": scenario.record.cars[scenario.car].driver,
        "lap": moment.lap if moment else None,
        "seed": scenario.seed,
        "race_number": None if scenario.from_file else scenario.race,
        "model": policy.name,
        "model_hash": policy.hash,
        "value_unit": _value_unit(scenario),
        "decision": None if decision is None else vars(decision) | {"margin": decision.margin},
        "warnings": warnings,
        "notes": notes,
        "explanations": [document(one) for one in made],
        "paper": paper,
        "state": _state(scenario),
        "seconds": seconds,
    }


def document(explanation: "Explanation") -> dict[str, Any]:
    """An explanation as JSON has it, parsed."""
    import json

    parsed: dict[str, Any] = json.loads(explanation.to_json())
    return parsed


def _of_policy(scenario: Scenario, request: Request) -> tuple[tuple[str, ...], list[str]]:
    """The methods asked for that the policy can be explained by, and a line on those left out.

    Raises:
        RsrlError: one was asked for by name and is not among them.
    """
    from rsrl.explanation import check_methods, explainable

    policy, methods = scenario.policy, explainable(scenario.policy, request.methods)
    tables = {"--safety-car-table": request.safety_car_table, "--fit-tree": request.fit_tree, "--tree-page": request.tree_page is not None}
    check_methods(policy, ["what-if", *(name for name, asked in tables.items() if asked)])
    if not request.every:
        check_methods(policy, request.methods)
    left_out = [name for name in request.methods if name not in methods]
    return methods, [f"Left out, because {policy.name} gives calls without values: {', '.join(left_out)}."] if left_out else []


def _possible(scenario: Scenario, request: Request, decision: "Decision | None") -> tuple[list[str], list[str]]:
    """The possible methods among those asked for, and a line on each one left out. Raises RsrlError if one was asked for by name."""
    methods, notes = list(request.methods), []
    if scenario.from_file and "summary" in methods:
        why = "a summary needs a whole race, and a state file holds a single moment"
        if not request.every:
            raise RsrlError(f"--method summary with --state: {why}; leave one out")
        methods.remove("summary")
        notes.append(f"Left out: {why}.")
    if decision is None:
        return methods, notes
    if not decision.alternative:
        left_out = [name for name in methods if name in NEED_ALTERNATIVES]
        methods = [name for name in methods if name not in NEED_ALTERNATIVES]
        notes.append(f"Only one call is legal for lap {decision.lap}: {_words(decision.call)}. There is no decision to explain.")
        notes += [f"Left out, because no other call is legal: {', '.join(left_out)}."] if left_out else []
    elif request.target and "counterfactual" in methods:
        _check_target(request.target, decision)
    return methods, notes


def _check_target(target: str, decision: "Decision") -> None:
    """Raise RsrlError if the target of a counterfactual is the policy's own call, or not legal."""
    others = [option for option, name in TARGETS.items() if name in decision.legal and name != decision.call]
    ask = f"ask for {', '.join(others[:-1])}{' or ' if others[1:] else ''}{others[-1]}"
    if TARGETS[target] == decision.call:
        raise RsrlError(f"--target {target}: {_words(decision.call)} is the call already made for lap {decision.lap}; {ask}")
    if target not in others:
        raise RsrlError(f"--target {target}: {_words(TARGETS[target])} may not be called for lap {decision.lap}; {ask}")


def _words(call: str) -> str:
    """A call as a pit wall says it."""
    from rsrl.state import ACTION_NAMES, Action

    return str(Action(ACTION_NAMES.index(call)))


def _prepared(scenario: Scenario, request: Request, output: Output) -> tuple[list["Explanation"], dict[str, float]]:
    """The safety-car table, if asked for, and the seconds it took."""
    if not request.safety_car_table:
        return [], {}
    with progress(output, "Simulating safety cars on every lap") as report:
        started = time.perf_counter()
        made = [_safety_car_table(scenario, report)]
    return made, {"safety-car-table": round(time.perf_counter() - started, 3)}


def _tree(scenario: Scenario, request: Request, methods: Sequence[str], output: Output, notes: list[str]) -> Any:
    """The policy's tree if any method needs it, its page written if asked for; else None.

    None as well if no tree was fitted and none is required by name; a note says so. A counterfactual can be found without a tree.
    """
    from rsrl.strategists.tree import MissingTreeError

    if not (request.fit_tree or request.tree or request.tree_page or {"tree", "counterfactual"} & set(methods)):
        return None
    if request.fit_tree and assumptions():
        raise RsrlError("--fit-tree with --set or --sets: a tree is stored for the race's own figures; leave one out")
    try:
        tree = _found_tree(scenario, request, output)
    except MissingTreeError as error:
        if request.tree_page or ("tree" in methods and not request.every):
            raise
        notes.append(f"Explained without a tree: {error}.")
        return None
    if assumptions():
        notes.append("The tree was fitted on the race's own figures, not on those assumed.")
    if request.tree_page:
        _write_page(scenario, tree, request.tree_page)
    return tree


def _found_tree(scenario: Scenario, request: Request, output: Output) -> Any:
    from rsrl.explanation import fit_tree
    from rsrl.explanation.tree.store import find_tree, read_tree, store_tree

    policy, record, car = scenario.own, scenario.record, scenario.car
    if request.tree is not None:
        return read_tree(request.tree, policy, record)
    if not request.fit_tree:
        return find_tree(policy, record, car)
    with progress(output, f"Fitting the tree of {policy.name} for {record.cars[car].driver} at {record.name}") as report:
        tree = fit_tree(policy, record, car, seed=scenario.seed, progress=report).tree
    output.note(f"Stored the tree in {store_tree(tree, policy, record, car)}")
    return tree


def _write_page(scenario: Scenario, tree: Any, path: Path) -> None:
    """Write the tree as a page of its own, the path of the decision open."""
    from rsrl.cli.files import write_text
    from rsrl.report.tree_page import tree_page
    from rsrl.strategists import TreeRows

    row = None if scenario.moment is None else TreeRows(tree.columns).of_race(scenario.moment.raw)[-1]
    write_text(path, tree_page(tree, row), "--tree-page")


def _what_if(scenario: Scenario, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_what_if

    return explain_what_if(scenario.policy, _moment(scenario), races=request.races, seed=scenario.seed)


def _attribution(scenario: Scenario, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_attribution

    background = request.background.replace("-", "_") if not Path(request.background).is_file() else request.background
    return explain_attribution(scenario.own, _moment(scenario), level=cast(Any, request.level), background=background, seed=scenario.seed)


def _tree_path(scenario: Scenario, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_tree

    return explain_tree(scenario.own, _moment(scenario), tree)


def _counterfactual(scenario: Scenario, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_counterfactual

    target = TARGETS[request.target] if request.target else None
    return explain_counterfactual(
        scenario.own, _moment(scenario), tree, target=target, norm=cast(Any, request.norm), level=cast(Any, request.check)
    )


def _summary(scenario: Scenario, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import summarise_race

    return summarise_race(scenario.own, scenario.record, scenario.car, seed=scenario.seed, race=scenario.race)


def _if_safety_car(scenario: Scenario, request: Request) -> list["Explanation"]:
    """What-ifs with a safety car and a virtual one just out; fewer futures suffice, since no later stops are compared."""
    from rsrl.explanation import explain_what_if
    from rsrl.season import GREEN, SC, VSC
    from rsrl.simulator import layout as at

    moment = _moment(scenario)
    if moment.lap < 2 or moment.arrays[2][at.R_STATUS] != GREEN:
        return []
    policy, seed, races = scenario.policy, scenario.seed, max(request.races // SAFETY_CAR_SHARE, 2)
    return [explain_what_if(policy, moment, races=races, seed=seed, horizon_laps=0, status=status) for status in (SC, VSC)]


MAKERS: Final[dict[str, Callable[[Scenario, Request, Any], "Explanation"]]] = {
    "what-if": _what_if,
    "attribution": _attribution,
    "tree": _tree_path,
    "counterfactual": _counterfactual,
    "summary": _summary,
}


def _moment(scenario: Scenario) -> "Moment":
    if scenario.moment is None:
        raise RsrlError("which lap? give --lap, or --state, a race state from a file")
    return scenario.moment


def _safety_car_table(scenario: Scenario, report: Callable[[int, int], None]) -> "Explanation":
    from rsrl.explanation import safety_car_table

    return safety_car_table(scenario.own, scenario.record, scenario.car, seed=scenario.seed, progress=report)


def _state(scenario: Scenario) -> dict[str, Any] | None:
    """The state explained, as --state takes it."""
    from rsrl.explanation.state_file import state_document, state_of

    return None if scenario.moment is None else state_document(state_of(scenario.moment))


def _has_values(scenario: Scenario) -> bool:
    """Whether the policy is RSRL's own and values its calls."""
    from rsrl.explanation import ExplainedPolicy

    return isinstance(scenario.policy, ExplainedPolicy)


def _warnings(scenario: Scenario) -> list[str]:
    """What lies outside the policy's training, of which nothing is known for one from elsewhere."""
    from rsrl.explanation.summary import state_warnings

    if scenario.moment is None or not _has_values(scenario):
        return []
    return state_warnings(scenario.own, scenario.moment, drive_races=scenario.from_file)


def _value_unit(scenario: Scenario) -> str:
    return scenario.own.unit if _has_values(scenario) else ""


def _paper(scenario: Scenario, made: Sequence["Explanation"], tree: Any) -> list[dict[str, Any]] | None:
    """The paper's findings beside ours, for the lap that the paper explains."""
    from rsrl.explanation.fidelity import paper

    if scenario.moment is None or scenario.from_file or not _has_values(scenario):
        return None
    if (scenario.record.name, scenario.moment.lap) != (paper.RACE, paper.LAP):
        return None
    return paper.read_beside(scenario.own, scenario.moment, made, tree)
