"""What the ways of explaining are to reach, and what the paper reports of its own; judged on measured figures, met or not."""

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

Figures = Mapping[str, Any]

OPERATORS: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq,
}  # fmt: skip


@dataclass(frozen=True)
class Goal:
    """One figure that is to be reached.

    Attributes:
        method: whose it is.
        what: the figure in words.
        paper: what the paper has, "" for nothing.
        path: where it stands in the figures of its method, names with dots between.
        relation: a sign of `OPERATORS`.
        bound: number it is compared with, or the path of one.
        fewest: races below which the goal is measured but not judged; 0 for any number.
    """

    method: str
    what: str
    paper: str
    path: str
    relation: str
    bound: float | str
    fewest: int = 0


@dataclass(frozen=True)
class Judged:
    """A goal with what was measured; `met` is None where it could not be judged, and `why` says why."""

    goal: Goal
    value: float | None
    bound: float | None
    met: bool | None
    why: str = ""

    def document(self) -> dict[str, Any]:
        """In types that JSON has."""
        goal = self.goal
        return {
            "method": goal.method,
            "what": goal.what,
            "paper": goal.paper,
            "value": self.value,
            "relation": goal.relation,
            "bound": self.bound,
            "met": self.met,
            "why": self.why,
        }


def judge(goals: Sequence[Goal], figures: Mapping[str, Figures]) -> list[Judged]:
    """Hold goals against the figures of each method; a method without figures, or a figure that is missing, is not met, and said so."""
    return [_judge(goal, figures.get(goal.method, {})) for goal in goals]


def _judge(goal: Goal, figures: Figures) -> Judged:
    value = look_up(figures, goal.path)
    bound = look_up(figures, goal.bound) if isinstance(goal.bound, str) else goal.bound
    if value is None or bound is None:
        return Judged(goal, value, bound, None, "not measured")
    races = figures.get("races", 0)
    if races < goal.fewest:
        return Judged(goal, value, bound, None, f"to be judged over {goal.fewest:,} races, measured over {races:,}")
    return Judged(goal, value, bound, OPERATORS[goal.relation](value, bound))


def look_up(figures: Figures, path: str) -> float | None:
    """A number by its path; None where there is none."""
    found: Any = figures
    for name in path.split("."):
        if isinstance(found, Sequence) and not isinstance(found, str) and name.isdecimal() and int(name) < len(found):
            found = found[int(name)]
        elif isinstance(found, Mapping) and name in found:
            found = found[name]
        else:
            return None
    return float(found) if isinstance(found, int | float) else None
