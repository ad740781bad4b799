"""Makes strategists by the names that users type."""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Final

from rsrl.agents import load_agent
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.strategists.dp import DpStrategist
from rsrl.strategists.heuristic import HeuristicStrategist
from rsrl.strategists.imitation import ImitationStrategist
from rsrl.strategists.interface import Strategist
from rsrl.strategists.lookahead.planner import PlannerStrategist
from rsrl.strategists.lookahead.policy_search import PolicySearchStrategist
from rsrl.strategists.plan_search.best_plan import BestPlanStrategist
from rsrl.strategists.plan_search.evaluator import Progress
from rsrl.strategists.plan_search.hindsight import HindsightStrategist
from rsrl.strategists.plan_search.planned import FixedStrategist
from rsrl.strategists.policy import find_model, is_model, load_policy, strategist_of
from rsrl.strategists.tree.strategist import default_tree_strategist


def _search(record: RaceRecord, car: int, seed: int) -> Strategist:
    """The shipped policy `all` with lookahead."""
    return PolicySearchStrategist(load_agent(find_model("all"))[0], record, car, seed)


_Maker = Callable[[RaceRecord, int, int, Progress | None], Strategist]

STRATEGISTS: Final[dict[str, _Maker]] = {
    "fixed": lambda record, car, seed, progress: FixedStrategist(record, car, seed),
    "heuristic": lambda record, car, seed, progress: HeuristicStrategist(record, car, seed),
    "best-plan": lambda record, car, seed, progress: BestPlanStrategist(record, car, seed, progress=progress),
    "best-plan-sc": lambda record, car, seed, progress: BestPlanStrategist(record, car, seed, sc_rule=True, progress=progress),
    "dp": lambda record, car, seed, progress: DpStrategist(record, car, seed),
    "tree": lambda record, car, seed, progress: default_tree_strategist(record, car),
    "imitation": lambda record, car, seed, progress: ImitationStrategist(record, car, seed),
    "planner": lambda record, car, seed, progress: PlannerStrategist(record, car, seed),
    "planner-1s": lambda record, car, seed, progress: PlannerStrategist(record, car, seed, 1000.0, name="planner-1s"),
    "search": lambda record, car, seed, progress: _search(record, car, seed),
    "hindsight": lambda record, car, seed, progress: HindsightStrategist(record, car, seed, progress=progress),
}
"""Makers of the strategists that need no model from the user, by name."""


def make_strategist(name: str, record: RaceRecord, car: int, *, seed: int = 0, progress: Progress | None = None) -> Strategist:
    """A strategist by name, for one car of a race.

    Args:
        seed: of the strategist's own random numbers and, for a plan search, of its own races; never of a race it is evaluated on.
        progress: called as a plan search simulates races.

    Raises:
        RsrlError: unknown name.
    """
    if name not in STRATEGISTS:
        raise RsrlError(f"unknown strategist {name!r}; there are {', '.join(STRATEGISTS)}")
    return STRATEGISTS[name](record, car, seed, progress)


def make_model_strategist(model: str, record: RaceRecord, taken: Collection[str] = ()) -> Strategist:
    """A model as a strategist, named by its kind, and by its folder too where that name is `taken`.

    Args:
        model: as of `load_policy`.

    Raises:
        RsrlError: there is no such model.
    """
    policy, _ = load_policy(model)
    name = f"{policy.kind} {Path(model).name}" if policy.kind in taken else policy.kind
    return strategist_of(policy, record, model if name in taken else name)


def strategist_names(text: str) -> list[str]:
    """Names of a list such as `fixed,runs/x`, each once; raises RsrlError for what is neither a strategist nor a model."""
    names = list(dict.fromkeys(word.strip() for word in text.split(",") if word.strip()))
    for name in names:
        if name not in STRATEGISTS and not is_model(name):
            raise RsrlError(
                f"unknown strategist {name!r}; there are {', '.join(STRATEGISTS)}, shipped policies, folders of trained models, model.zip "
                "and module:function"
            )
    return names
