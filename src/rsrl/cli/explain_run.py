"""What `rsrl explain` does: the decision it is about, each method asked for, and the result they make together."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from rsrl.cli.explain_options import TARGETS
from rsrl.cli.explain_subject import Subject
from rsrl.cli.output import Output
from rsrl.cli.progress import brief, progress
from rsrl.errors import RsrlError

if TYPE_CHECKING:
    from rsrl.explanation import Decision, Explanation, Moment

NEED_ALTERNATIVES: Final = ("attribution", "tree", "counterfactual")
"""Methods that compare the call with another legal one."""


SAFETY_CAR_SHARE: Final = 4
"""The what-ifs under a safety car have so many times fewer races than that of the lap as it is."""


@dataclass(frozen=True)
class Request:
    """The options of the command, checked. `every`: all methods, so that one which cannot be made is told instead of refused."""

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


def run(subject: Subject, request: Request, output: Output) -> dict[str, Any]:
    """The whole result, as `rsrl explain --json` has it but for the provenance.

    Raises:
        RsrlError: a method or another call that this decision does not have; told before anything is worked out.
    """
    from rsrl.explanation.summary import state_warnings, value_unit

    policy, moment = subject.policy, subject.moment
    decision = policy.decide(moment) if moment else None
    methods, notes = _possible(subject, request, decision)
    tree = _tree(subject, request, methods, output, notes)
    made, seconds = _prepared(subject, request, output)
    with brief(output, f"Explaining lap {moment.lap}" if moment else "Telling the race") as step:
        for name in methods:
            if name == "tree" and tree is None:
                continue
            step(name)
            started = time.perf_counter()
            made.append(MAKERS[name](subject, request, tree))
            if name == "what-if" and decision is not None and decision.alternative:
                made += _if_safety_car(subject, request)
            seconds[name] = round(time.perf_counter() - started, 3)
        step("what lies outside training, and the paper's reading")
        warnings = state_warnings(policy, moment, drive_races=subject.from_file) if moment else []
        paper = _paper(subject, made, tree)
    return {
        "race": subject.record.name,
        "driver": subject.record.cars[subject.car].driver,
        "lap": moment.lap if moment else None,
        "seed": subject.seed,
        "race_number": None if subject.from_file else subject.race,
        "model": policy.name,
        "model_hash": policy.hash,
        "value_unit": value_unit(policy),
        "decision": None if decision is None else vars(decision) | {"margin": decision.margin},
        "warnings": warnings,
        "notes": notes,
        "explanations": [document(one) for one in made],
        "paper": paper,
        "state": _state(subject),
        "seconds": seconds,
    }


def document(explanation: "Explanation") -> dict[str, Any]:
    """An explanation as JSON has it, parsed."""
    import json

    parsed: dict[str, Any] = json.loads(explanation.to_json())
    return parsed


def _possible(subject: Subject, request: Request, decision: "Decision | None") -> tuple[list[str], list[str]]:
    """The methods asked for that can be made here, and a line on each thing left out. Raises RsrlError where one was asked for by name."""
    methods, notes = list(request.methods), []
    if subject.from_file and "summary" in methods:
        why = "a summary tells a whole race, which a state from a file has not"
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
        notes += [f"Left out, as there is no other call: {', '.join(left_out)}."] if left_out else []
    elif request.target and "counterfactual" in methods:
        _check_target(request.target, decision)
    return methods, notes


def _check_target(target: str, decision: "Decision") -> None:
    """Raise RsrlError where a counterfactual cannot be asked for: of the call itself, or of one that may not be made."""
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


def _prepared(subject: Subject, request: Request, output: Output) -> tuple[list["Explanation"], dict[str, float]]:
    """The safety-car table, where it is asked for, and the seconds it took."""
    if not request.safety_car_table:
        return [], {}
    with progress(output, "Driving the race under safety cars") as report:
        started = time.perf_counter()
        made = [_safety_car_table(subject, report)]
    return made, {"safety-car-table": round(time.perf_counter() - started, 3)}


def _tree(subject: Subject, request: Request, methods: Sequence[str], output: Output, notes: list[str]) -> Any:
    """The policy's tree, where anything needs it; a page of it is written.

    None where none was fitted and it was not asked for by name, which is noted: a counterfactual is found without, too.
    """
    from rsrl.strategists.tree import MissingTreeError

    if not (request.fit_tree or request.tree or request.tree_page or {"tree", "counterfactual"} & set(methods)):
        return None
    try:
        tree = _found_tree(subject, request, output)
    except MissingTreeError as error:
        if request.tree_page or ("tree" in methods and not request.every):
            raise
        notes.append(f"Explained without a tree: {error}.")
        return None
    if request.tree_page:
        _write_page(subject, tree, request.tree_page)
    return tree


def _found_tree(subject: Subject, request: Request, output: Output) -> Any:
    from rsrl.explanation import fit_tree
    from rsrl.explanation.tree.store import find_tree, read_tree, store_tree

    policy, record, car = subject.policy, subject.record, subject.car
    if request.tree is not None:
        return read_tree(request.tree, policy, record)
    if not request.fit_tree:
        return find_tree(policy, record, car)
    with progress(output, f"Fitting the tree of {policy.name} for {record.cars[car].driver} at {record.name}") as report:
        tree = fit_tree(policy, record, car, seed=subject.seed, progress=report).tree
    output.note(f"Stored the tree in {store_tree(tree, policy, record, car)}")
    return tree


def _write_page(subject: Subject, tree: Any, path: Path) -> None:
    """The tree as a page of its own, the way of the decision open."""
    from rsrl.cli.files import write_text
    from rsrl.explanation.tree import tree_page
    from rsrl.strategists import TreeRows

    row = None if subject.moment is None else TreeRows(tree.columns).of_race(subject.moment.raw)[-1]
    write_text(path, tree_page(tree, row), "--tree-page")


def _what_if(subject: Subject, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_what_if

    return explain_what_if(subject.policy, _moment(subject), races=request.races, seed=subject.seed)


def _attribution(subject: Subject, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_attribution

    background = request.background.replace("-", "_") if not Path(request.background).is_file() else request.background
    return explain_attribution(subject.policy, _moment(subject), level=cast(Any, request.level), background=background, seed=subject.seed)


def _tree_path(subject: Subject, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_tree

    return explain_tree(subject.policy, _moment(subject), tree)


def _counterfactual(subject: Subject, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import explain_counterfactual

    target = TARGETS[request.target] if request.target else None
    return explain_counterfactual(
        subject.policy, _moment(subject), tree, target=target, norm=cast(Any, request.norm), level=cast(Any, request.check)
    )


def _summary(subject: Subject, request: Request, tree: Any) -> "Explanation":
    from rsrl.explanation import summarise_race

    return summarise_race(subject.policy, subject.record, subject.car, seed=subject.seed, race=subject.race)


def _if_safety_car(subject: Subject, request: Request) -> list["Explanation"]:
    """The calls of this lap had a safety car, or a virtual one, just come out; fewer races, since there is less to choose."""
    from rsrl.explanation import explain_what_if
    from rsrl.season import GREEN, SC, VSC
    from rsrl.simulator import layout as at

    moment = _moment(subject)
    if moment.lap < 2 or moment.arrays[2][at.R_STATUS] != GREEN:
        return []
    races = max(request.races // SAFETY_CAR_SHARE, 2)
    return [explain_what_if(subject.policy, moment, races=races, seed=subject.seed, horizon_laps=0, status=status) for status in (SC, VSC)]


MAKERS: Final[dict[str, Callable[[Subject, Request, Any], "Explanation"]]] = {
    "what-if": _what_if,
    "attribution": _attribution,
    "tree": _tree_path,
    "counterfactual": _counterfactual,
    "summary": _summary,
}


def _moment(subject: Subject) -> "Moment":
    if subject.moment is None:
        raise RsrlError("which lap? give --lap, or --state, a race state from a file")
    return subject.moment


def _safety_car_table(subject: Subject, report: Callable[[int, int], None]) -> "Explanation":
    from rsrl.explanation import safety_car_table

    return safety_car_table(subject.policy, subject.record, subject.car, seed=subject.seed, progress=report)


def _state(subject: Subject) -> dict[str, Any] | None:
    """The state explained, as --state takes it."""
    from rsrl.explanation.state_file import state_document, state_of

    return None if subject.moment is None else state_document(state_of(subject.moment))


def _paper(subject: Subject, made: Sequence["Explanation"], tree: Any) -> list[dict[str, Any]] | None:
    """The paper's reading beside ours, for the lap the paper shows."""
    from rsrl.explanation.fidelity import paper

    if subject.moment is None or subject.from_file or (subject.record.name, subject.moment.lap) != (paper.RACE, paper.LAP):
        return None
    return paper.read_beside(subject.policy, subject.moment, made, tree)
