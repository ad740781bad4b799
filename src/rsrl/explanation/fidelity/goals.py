"""Goals for the ways of explaining, beside the paper's figures, and whether measured figures meet them."""

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

Figures = Mapping[str, Any]

OPERATORS: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq,
}  # fmt: skip

DRIVING_RACES: Final = 1920
FIDELITY_RACES: Final = 100
"""Races below which a figure is not judged."""


@dataclass(frozen=True)
class Goal:
    """A bound for one figure.

    Attributes:
        method: whose figure it is.
        what: the figure in words.
        paper: the paper's figure, "" for none.
        path: where the figure stands among those of its method, names with dots between.
        relation: a sign of `OPERATORS`.
        bound: number it is compared with, or the path of one.
        fewest: races below which the figure is reported but not judged; 0 for any number.
        by_construction: the code makes it so, whatever the policy: a figure that is off is a bug, and one that is not is no merit.
    """

    method: str
    what: str
    paper: str
    path: str
    relation: str
    bound: float | str
    fewest: int = 0
    by_construction: bool = False


GOALS: Final = (
    Goal(
        "attribution", "values add up: largest rounding error over the range of Q", "error 5 %, of an unstated quantity",
        "efficiency_gap_of_q_range.largest", "<", 1e-5, FIDELITY_RACES, by_construction=True,
    ),
    Goal(
        "attribution", "share of decisions explained exactly", "", "exact_by_construction", "=", 1.0, FIDELITY_RACES, by_construction=True
    ),
    Goal("attribution", "seconds for an exact explanation, 95th percentile", "", "seconds.p95", "<", 0.5, FIDELITY_RACES),
    Goal("attribution", "mean error of sampled values against exact ones", "", "sampled.relative_error.mean", "<", 0.02, FIDELITY_RACES),
    Goal(
        "attribution", "Kendall tau of sampled values across seeds", "", "sampled.kendall_tau_across_seeds.mean", ">", 0.95, FIDELITY_RACES
    ),
    Goal(
        "attribution", "insertion curve outside the random band, share of its points", "",
        "curves.insertion.outside_band_share_of_points", "=", 1.0, FIDELITY_RACES,
    ),
    Goal(
        "attribution", "deletion curve outside the random band, share of its points", "",
        "curves.deletion.outside_band_share_of_points", "=", 1.0, FIDELITY_RACES,
    ),
    Goal("tree", "accuracy, against the commonest call", ".926, below .933", "labels.accuracy", ">", "labels.majority", FIDELITY_RACES),
    Goal("tree", "macro-F1", ".34", "labels.macro_f1", ">", 0.60, FIDELITY_RACES),
    Goal("tree", "right compound within one lap", ".15 of stops found", "stops.within_one_lap.value", ">", 0.70, FIDELITY_RACES),
    Goal("tree", "leaves", "", "leaves", "<=", 48.0),
    Goal("tree", "places behind the policy, upper end of 95 %", "not measured", "behind_policy.ci95.1", "<", 0.2, DRIVING_RACES),
    Goal("tree", "places ahead of fixed, lower end of 95 %", "not measured", "ahead_of_fixed.ci95.0", ">", 0.0, DRIVING_RACES),
    Goal("tree", "places ahead of heuristic, lower end of 95 %", "not measured", "ahead_of_heuristic.ci95.0", ">", 0.0, DRIVING_RACES),
    Goal(
        "counterfactual", "share of those shown that the policy confirms", "not checked", "best_other.confirmed_by_construction.value", "=",
        1.0, FIDELITY_RACES, by_construction=True,
    ),
    Goal("counterfactual", "share found, for the best other call", "", "best_other.found.value", ">", 0.80, FIDELITY_RACES),
    Goal("counterfactual", "share found, for a random other call", "", "random.found.value", ">", 0.80, FIDELITY_RACES),
    Goal("counterfactual", "causes changed, for the best other call", "1.63", "best_other.causes_changed.value", "<=", 1.6, FIDELITY_RACES),
    Goal("counterfactual", "causes changed, for a random other call", "1.63", "random.causes_changed.value", "<=", 1.6, FIDELITY_RACES),
    Goal("counterfactual", "ms for tree and check, mean", "", "best_other.wall_ms.mean", "<", 50.0, FIDELITY_RACES),
    Goal("what-if", "seconds for all options, the slowest moment", "", "seconds_most", "<", 2.0),
    Goal("what-if", "coverage of 95 % intervals, upper end", "", "coverage_high", ">=", 0.95),
    Goal("what-if", "coverage of 95 % intervals, lower end", "", "coverage_low", "<=", 0.95),
    Goal("all", "seconds for all methods, one lap", "", "seconds.median", "<", 3.0),
)  # fmt: skip
"""A goal is never removed because it was missed."""


@dataclass(frozen=True)
class Judged:
    """A goal with its measured value; `met` is None where it could not be judged, and `why` says why."""

    goal: Goal
    value: float | None
    bound: float | None
    met: bool | None
    why: str = ""

    def document(self) -> dict[str, Any]:
        """The goal in types that JSON has."""
        goal = self.goal
        return {
            "method": goal.method,
            "what": goal.what,
            "paper": goal.paper,
            "value": self.value,
            "relation": goal.relation,
            "bound": self.bound,
            "by_construction": goal.by_construction,
            "met": self.met,
            "why": self.why,
        }


def judge(goals: Sequence[Goal], figures: Mapping[str, Figures]) -> list[Judged]:
    """Compare the figures of each method with their goals; a figure that is missing is not judged, and the result says so."""
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
