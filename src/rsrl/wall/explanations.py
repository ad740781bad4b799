"""Explanations that a viewer asks for: the methods of `rsrl explain`, each as one message."""

import json
import time
from collections.abc import Callable
from typing import Any, Final

from rsrl.errors import RsrlError
from rsrl.explanation import (
    AnyPolicy,
    ExplainedPolicy,
    Explanation,
    Moment,
    check_methods,
    explain_attribution,
    explain_counterfactual,
    explain_tree,
    explain_what_if,
    explainable,
    state_warnings,
    summarise_race,
)
from rsrl.explanation.tree.store import find_tree
from rsrl.state import ACTION_NAMES
from rsrl.strategists import Tree
from rsrl.strategists.tree import MissingTreeError
from rsrl.wall.messages import CALLS, ExplanationMessage, ExplanationRow, Marks
from rsrl.wall.messages.server import Method

WHAT_IF_FUTURES: Final = 1000
"""The first of the 2000 that `rsrl explain` runs by default, of the same seed."""

METHODS: Final[tuple[Method, ...]] = ("what-if", "attribution", "tree", "counterfactual", "summary", "training")
OWN: Final = ("attribution", "tree", "counterfactual", "summary", "training")
"""Methods that need the policy's values."""

ALTERNATIVES: Final = ("attribution", "tree", "counterfactual")
"""Methods that compare the call with another legal one."""

MARKS: Final[Marks] = {"rows.value": "derived", "details": "derived"}

Told = Callable[[int, int, str], None]
"""Called with parts done, parts in all, and what is being done."""


class Asked:
    """What a viewer asks: `target` is the other call of a counterfactual, 0 to 3; None for the next best."""

    def __init__(self, session: str, request: int, method: Method, driver: str, lap: int, target: int | None) -> None:
        self.session, self.request, self.method, self.driver, self.lap, self.target = session, request, method, driver, lap, target


def possible(policy: AnyPolicy, simulated: bool) -> tuple[Method, ...]:
    """Methods that can be asked for; a summary is of a whole race that the policy called."""
    if not isinstance(policy, ExplainedPolicy):
        return tuple(m for m in METHODS if m in explainable(policy, [m]))
    return tuple(m for m in METHODS if simulated or m != "summary")


class Explainer:
    """Explains the calls of one session; slow, for a thread of its own.

    Args:
        seed: of the futures and of a simulated race; race_number: of a simulated race, None for another.
    """

    def __init__(self, policy: AnyPolicy, seed: int, race_number: int | None) -> None:
        self._policy, self._seed, self._race_number = policy, seed, race_number
        self._trees: dict[int, Tree | None] = {}

    def explain(self, asked: Asked, moment: Moment, tell: Told, until_lap: int | None = None) -> ExplanationMessage:
        """The explanation asked for.

        Args:
            until_lap: a summary tells nothing of later laps, nor of how the race ends; None for the whole race.

        Raises:
            RsrlError: it is not possible for this policy.
        """
        begun = time.perf_counter()
        decision = self._policy.decide(moment)
        common: dict[str, Any] = {
            "session": asked.session,
            "request": asked.request,
            "method": asked.method,
            "lap": moment.lap,
            "driver": moment.driver,
            "call": CALLS[ACTION_NAMES.index(decision.call)],
            "marks": MARKS,
        }
        if asked.method in ALTERNATIVES and not decision.alternative:
            return _nothing(common, "only one call is legal on this lap: there is no decision to explain", begun)
        if asked.method == "training":
            return self._training(common, moment, begun)
        notes: list[str] = []
        tree = self._tree(moment, notes) if asked.method in ("tree", "counterfactual") else None
        if asked.method == "tree" and tree is None:
            return _nothing(common, notes[0], begun)
        tell(0, 1, asked.method)
        found = self._found(asked, moment, tree, tell)
        document = json.loads(found.to_json())
        if asked.method == "summary" and until_lap is not None:
            document = _cut(document, until_lap)
        return ExplanationMessage(
            **common,
            question=found.question,
            unit=found.unit,
            baseline=document["baseline"],
            exact=found.exact,
            budget=found.budget,
            rows=tuple(_row(row) for row in document["rows"]),
            sentences=tuple(document["sentences"]),
            notes=tuple(notes),
            details=document["details"] | ({"tree": _nodes(tree)} if asked.method == "tree" and tree is not None else {}),
            took_ms=round(1000 * (time.perf_counter() - begun), 1),
        )

    def _found(self, asked: Asked, moment: Moment, tree: Tree | None, tell: Told) -> Explanation:
        if asked.method == "what-if":
            return explain_what_if(
                self._policy,
                moment,
                races=WHAT_IF_FUTURES,
                seed=self._seed,
                progress=lambda done, of: tell(done, of, "simulating futures"),
            )
        check_methods(self._policy, [asked.method])
        policy = self._policy
        assert isinstance(policy, ExplainedPolicy)
        if asked.method == "attribution":
            return explain_attribution(policy, moment, seed=self._seed)
        if asked.method == "tree":
            assert tree is not None
            return explain_tree(policy, moment, tree)
        if asked.method == "counterfactual":
            target = None if asked.target is None else ACTION_NAMES[asked.target]
            # the strongest check is by rollouts, which only a simulated race allows for the laps before
            return explain_counterfactual(policy, moment, tree, target=target)
        if self._race_number is None or moment.seed is None:
            raise RsrlError("a summary is of the car that the policy drives in a simulated race")
        return summarise_race(policy, moment.record, moment.car, seed=self._seed, race=self._race_number)

    def _tree(self, moment: Moment, notes: list[str]) -> Tree | None:
        """The policy's tree for the car, None where none was fitted; a note says so."""
        assert isinstance(self._policy, ExplainedPolicy)
        try:
            if moment.car not in self._trees:
                self._trees[moment.car] = find_tree(self._policy, moment.record, moment.car)
            return self._trees[moment.car]
        except MissingTreeError as error:
            notes.append(str(error))
            return None

    def _training(self, common: dict[str, Any], moment: Moment, begun: float) -> ExplanationMessage:
        check_methods(self._policy, ["attribution"])
        assert isinstance(self._policy, ExplainedPolicy)
        lines = state_warnings(self._policy, moment, drive_races=True)
        return ExplanationMessage(
            **common,
            question="what lies outside the policy's training",
            unit="",
            baseline=None,
            exact=True,
            budget=0,
            rows=tuple(ExplanationRow(label=line, value=None, columns={}) for line in lines),
            sentences=tuple(lines) or ("Nothing on this lap lies outside the policy's training.",),
            notes=(),
            details={},
            took_ms=round(1000 * (time.perf_counter() - begun), 1),
        )


def _row(row: dict[str, Any]) -> ExplanationRow:
    shown = {"label", "value", "low", "high"}
    columns = {name: value for name, value in row.items() if name not in shown}
    return ExplanationRow(label=row["label"], value=row["value"], low=row.get("low"), high=row.get("high"), columns=columns)


def _cut(document: dict[str, Any], lap: int) -> dict[str, Any]:
    """A summary without laps after `lap`, and without how the race ended."""
    told = [s for s in document["details"]["sentences"] if all(reference["lap"] <= lap for reference in s["references"])]
    details = {
        "seed": document["details"]["seed"],
        "race_number": document["details"]["race_number"],
        "stops": [stop for stop in document["details"]["stops"] if stop["lap"] < lap],
        "mattered": [one for one in document["details"]["mattered"] if one["lap"] <= lap],
        "until_lap": lap,
    }
    rows = [row for row in document["rows"] if row["lap"] <= lap]
    return document | {"rows": rows, "details": details, "sentences": [s["text"] for s in told]}


def _nodes(tree: Tree) -> dict[str, Any]:
    """The tree's nodes as lists, for a drawing of it: left and right are -1 at a leaf."""
    return {
        "feature": [tree.columns[i] if i >= 0 else "" for i in tree.feature.tolist()],
        "threshold": [round(float(t), 4) for t in tree.threshold],
        "left": tree.left.tolist(),
        "right": tree.right.tolist(),
        "call": [CALLS[a] for a in tree.action.tolist()],
        "samples": tree.samples.tolist(),
    }


def _nothing(common: dict[str, Any], why: str, begun: float) -> ExplanationMessage:
    return ExplanationMessage(
        **common,
        question="",
        unit="",
        baseline=None,
        exact=True,
        budget=0,
        rows=(),
        sentences=(),
        notes=(why,),
        details={},
        took_ms=round(1000 * (time.perf_counter() - begun), 1),
    )
