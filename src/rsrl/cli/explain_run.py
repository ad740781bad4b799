"""What `rsrl explain` does: the decision it is about, each method asked for, and the result they make together."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from rsrl.cli.explain_options import TARGETS
from rsrl.cli.output import Output
from rsrl.cli.progress import progress
from rsrl.errors import RsrlError

if TYPE_CHECKING:
    from rsrl.explanation import Decision, ExplainedPolicy, Explanation, Moment
    from rsrl.season import RaceRecord
    from rsrl.state import UnifiedRaceState

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


class Subject(NamedTuple):
    """Policy, race and car, and where a lap is explained the decision."""

    policy: "ExplainedPolicy"
    record: "RaceRecord"
    car: int
    seed: int
    race: int
    moment: "Moment | None"
    from_file: bool


def find_subject(
    model: str, race: str | None, driver: str | None, lap: int | None, state: Path | None, seed: int, race_number: int
) -> Subject:
    """What is to be explained.

    Raises:
        RsrlError: no such model, race, driver or lap, a race that is over before it, or a state file that is none.
    """
    from rsrl.explanation import load_explained, reach
    from rsrl.explanation.state_file import read_state
    from rsrl.season import GROUPS, find_car, load_race

    policy = load_explained(model)
    found = read_state(state) if state is not None else None
    name = race or (found.race if found else policy.about.race)
    if not name or name in GROUPS or "," in name:
        raise RsrlError(f"{model} is a policy for {name or 'no race'}: name the race to explain with --race, such as bahrain-2023")
    record = load_race(name)
    if found is not None and state is not None:
        return _from_state(policy, record, found, str(state), driver, lap, seed)
    car = find_car(record, driver)
    moment = None if lap is None else reach(policy.strategist(record), record, car, lap, seed=seed, race=race_number)
    return Subject(policy, record, car, seed, race_number, moment, False)


def _from_state(
    policy: "ExplainedPolicy", record: "RaceRecord", state: "UnifiedRaceState", where: str, driver: str | None, lap: int | None, seed: int
) -> Subject:
    from rsrl.explanation import moment_from_state
    from rsrl.explanation.state_file import check_race

    car = check_race(state, record, where)
    if driver is not None and driver != state.driver:
        raise RsrlError(f"{where}: driver is {state.driver}, but --driver is {driver}; leave --driver out")
    if lap is not None and lap != state.laps_completed + 1:
        raise RsrlError(f"{where}: laps_completed is {state.laps_completed}, so the call is for lap {state.laps_completed + 1}, not {lap}")
    return Subject(policy, record, car, seed, 0, moment_from_state(record, car, state), True)


def run(subject: Subject, request: Request, output: Output) -> dict[str, Any]:
    """The whole result, as `rsrl explain --json` has it but for the provenance."""
    from rsrl.explanation.summary import state_warnings

    policy, moment = subject.policy, subject.moment
    decision = policy.decide(moment) if moment else None
    warnings = state_warnings(policy, moment, drive_races=subject.from_file) if moment else []
    made, seconds, notes, tree = _explanations(subject, request, decision, output)
    return {
        "race": subject.record.name,
        "driver": subject.record.cars[subject.car].driver,
        "lap": moment.lap if moment else None,
        "seed": subject.seed,
        "race_number": None if subject.from_file else subject.race,
        "model": policy.name,
        "model_hash": policy.hash,
        "decision": None if decision is None else vars(decision) | {"margin": decision.margin},
        "warnings": warnings,
        "notes": notes,
        "explanations": [document(one) for one in made],
        "paper": _paper(subject, made, tree),
        "state": _state(subject),
        "seconds": seconds,
    }


def document(explanation: "Explanation") -> dict[str, Any]:
    """An explanation as JSON has it, parsed."""
    import json

    parsed: dict[str, Any] = json.loads(explanation.to_json())
    return parsed


def _explanations(
    subject: Subject, request: Request, decision: "Decision | None", output: Output
) -> tuple[list["Explanation"], dict[str, float], list[str], Any]:
    """Each method's explanation, the seconds it took, what was left out and why, and the tree."""
    made, seconds, notes = [], {}, []
    methods = list(request.methods)
    if decision is not None and not decision.alternative:
        left_out = [name for name in methods if name in NEED_ALTERNATIVES]
        methods = [name for name in methods if name not in NEED_ALTERNATIVES]
        notes.append(f"Only one call is legal for lap {decision.lap}: {decision.call}. There is no decision to explain.")
        notes += [f"Left out, as there is no other call: {', '.join(left_out)}."] if left_out else []
    tree = None
    if request.fit_tree or request.tree_page or {"tree", "counterfactual"} & set(methods):
        tree, why = _tree(subject, request, output)
        if tree is None:
            notes.append(why)
            methods = [name for name in methods if name != "tree"]
        if tree is not None and request.tree_page:
            _write_page(subject, tree, request.tree_page)
    if request.safety_car_table:
        with progress(output, "Driving the race under safety cars") as report:
            started = time.perf_counter()
            made.append(_safety_car_table(subject, report))
            seconds["safety-car-table"] = time.perf_counter() - started
    for name in methods:
        started = time.perf_counter()
        made.append(MAKERS[name](subject, request, tree))
        if name == "what-if" and decision is not None and decision.alternative:
            made += _if_safety_car(subject, request)
        seconds[name] = round(time.perf_counter() - started, 3)
    return made, seconds, notes, tree


def _tree(subject: Subject, request: Request, output: Output) -> tuple[Any, str]:
    """The policy's tree; None and why, where none was fitted and it was not asked for by name: a counterfactual is found without, too."""
    from rsrl.explanation import fit_tree
    from rsrl.explanation.tree_store import MissingTreeError, find_tree, read_tree, store_tree

    policy, record, car = subject.policy, subject.record, subject.car
    if request.tree is not None:
        return read_tree(request.tree, policy, record), ""
    if request.fit_tree:
        with progress(output, f"Fitting the tree of {policy.name} for {record.cars[car].driver} at {record.name}") as report:
            tree = fit_tree(policy, record, car, seed=subject.seed, progress=report).tree
        output.note(f"Stored the tree in {store_tree(tree, policy, record, car)}")
        return tree, ""
    try:
        return find_tree(policy, record, car), ""
    except MissingTreeError as error:
        if request.tree_page or ("tree" in request.methods and not request.every):
            raise
        return None, f"Without a tree: {error}."


def _write_page(subject: Subject, tree: Any, path: Path) -> None:
    """The tree as a page of its own, the way of the decision open."""
    from rsrl.cli.files import write_text
    from rsrl.explanation.tree import tree_page
    from rsrl.strategists import TreeRows

    row = None if subject.moment is None else TreeRows(tree.columns).of_race(subject.moment.raw)[-1]
    write_text(path, tree_page(tree, row))


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
    from rsrl.explanation import paper

    if subject.moment is None or subject.from_file or (subject.record.name, subject.moment.lap) != (paper.RACE, paper.LAP):
        return None
    return paper.read_beside(subject.policy, subject.moment, made, tree)
