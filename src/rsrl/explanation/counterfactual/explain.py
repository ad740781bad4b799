"""The entry point: the smallest change of causes under which the policy itself makes another call."""

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.attribution.values import single_blas_thread
from rsrl.explanation.counterfactual.change import Change, ChangeDistance, RaceEditor, change_rows, empty_rows, laps_ahead
from rsrl.explanation.counterfactual.edit_kernels import CALLED, LATER
from rsrl.explanation.counterfactual.grid import Grid
from rsrl.explanation.counterfactual.leaves import confirmed_on_last_lap, nearest_leaves
from rsrl.explanation.counterfactual.query import PolicyQuery
from rsrl.explanation.counterfactual.report import SearchResult, no_alternative, report, report_on_last_lap
from rsrl.explanation.counterfactual.rollout_check import RolloutShare, rollout_share
from rsrl.explanation.counterfactual.search import Counterfactual, Search
from rsrl.explanation.counterfactual.space import Norm
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Decision, Explanation
from rsrl.state import ACTION_NAMES, COLUMN, Action, Observer
from rsrl.strategists import Tree

Floats = NDArray[np.float32]
Level = Literal["last-lap", "consistent", "simulated"]
LEVELS: Final[tuple[Level, ...]] = ("last-lap", "consistent", "simulated")
HOLDS_FROM: Final = 0.5
"""Share of rollouts from which on a counterfactual is preferred to others that hold less often."""

NONE: Final[NDArray[np.bool_]] = np.zeros(0, np.bool_)
NO_CALLS: Final[NDArray[np.int8]] = np.zeros(0, np.int8)


def find_counterfactual(
    policy: ExplainedPolicy,
    moment: Moment,
    tree: Tree | None,
    target: int,
    norm: Norm = "l1",
    *,
    simulate: bool = False,
    observer: Observer | None = None,
    seed: int = 0,
) -> SearchResult:
    """Look for the smallest change under which the policy calls `target`; only changes that the policy confirms are returned.

    The arguments are those of `explain_counterfactual`; `simulate` checks what is found in rollouts.
    """
    query = PolicyQuery(policy, moment, RaceEditor(moment.record, moment.car, moment.arrays, observer))
    with single_blas_thread():  # products this small are slower on several threads, and their bits would depend on how many
        calls = query.calls_of(change_rows([Change(laps_called=1)]))
        grid = Grid(moment.raw[-1], target, NO_CALLS if calls is None else calls[0])
        distance = ChangeDistance(moment.record, policy.agent.feature_set, moment.raw[-1], *_expected_rows(query))
        leaves, on_last_lap, consistent, names_a_cause = None, NONE, NONE, NONE
        rows = empty_rows(0)
        if tree is not None:
            leaves = nearest_leaves(tree, moment, policy.agent.feature_set, target, norm)
            on_last_lap = confirmed_on_last_lap(query, leaves, target)
            rows = np.concatenate([rows, *(grid.from_leaf(point, leaves.space) for point in leaves.points)])
            names_a_cause = np.array(~np.isnan(rows).all(axis=1), np.bool_)
            consistent = query.ask(rows).confirm(target) & names_a_cause if len(rows) else consistent
            rows = rows[consistent]
        found = Search(query, distance, target, norm, grid, rows).run()
        share = None
        if simulate and found:
            found, share = _first_that_holds(query, found, target, seed)
    return SearchResult(leaves, on_last_lap, consistent, names_a_cause, tuple(found), share, query.asked)


def _expected_rows(query: PolicyQuery) -> tuple[Floats, Floats]:
    """Raw rows expected 0, 1, 2 ... laps from now, staying out and as the policy calls, float32 [laps, RAW_SIZE] each."""
    laps = max(int(query.moment.raw[-1, COLUMN["laps_left"]]), 1)
    unchanged = empty_rows(1)[0]
    rows = np.concatenate([laps_ahead(unchanged, LATER, laps), laps_ahead(unchanged, CALLED, laps)])
    raw = query.editor.edit(rows, query.calls_of(rows)).raw
    return raw[:laps], raw[laps:]


def _first_that_holds(
    query: PolicyQuery, found: list[Counterfactual], target: int, seed: int
) -> tuple[list[Counterfactual], RolloutShare | None]:
    """The first counterfactual that holds in most rollouts moved to the front; where none does, the order stays."""
    first: RolloutShare | None = None
    for i, one in enumerate(found):
        share = rollout_share(query, one, target, seed=seed)
        if share is not None and share.share >= HOLDS_FROM:
            return [one, *found[:i], *found[i + 1 :]], share
        first = share if i == 0 else first
    return found, first


def explain_counterfactual(
    policy: ExplainedPolicy,
    moment: Moment,
    tree: Tree | None,
    *,
    target: str | int | None = None,
    norm: Norm = "l1",
    level: Level = "consistent",
    observer: Observer | None = None,
    seed: int = 0,
) -> Explanation:
    """What would have to be different for the policy to make another call.

    Args:
        tree: the surrogate tree whose nearest leaves are tried first and reported; None for none.
        target: the call asked for, by name or number; None for the best other legal one.
        norm: "l0", "l1" or "l2": how distances add up among changes of as many causes.
        level: the check that what is shown has passed. "last-lap": a leaf's features put into the last row; "consistent": the change made
            to the race, and all that follows from it computed anew; "simulated": besides, rollouts in which all hidden state is drawn
            anew, with the share of them in which the call is made.
        observer: of the record and car, to reuse one.
        seed: of the rollouts.

    Raises:
        RsrlError: an unknown call, norm or level; the call asked for is the one made; a tree of another model; "last-lap" without a tree.
    """
    decision = policy.decide(moment)
    if norm not in ("l0", "l1", "l2") or level not in LEVELS:
        raise RsrlError(f"counterfactual: no norm {norm!r} with level {level!r}; norms are l0, l1, l2 and levels {', '.join(LEVELS)}")
    if tree is not None and tree.model_hash and tree.model_hash != policy.hash:
        raise RsrlError(f"the tree is of another model, {tree.model_hash}; the policy asked for is {policy.hash}; fit the tree again")
    call = _target(decision, target)
    if call is None:
        return no_alternative(decision)
    if level == "last-lap" and tree is None:
        raise RsrlError("a counterfactual checked on the last lap alone needs a tree; fit one, or ask for the level consistent")
    result = find_counterfactual(policy, moment, tree, call, norm, simulate=level == "simulated", observer=observer, seed=seed)
    if level == "last-lap":
        return report_on_last_lap(decision, call, norm, result)
    return report(decision, call, norm, result, rolled_out=level == "simulated")


def _target(decision: Decision, target: str | int | None) -> int | None:
    """The call asked for; None where there is no other legal call."""
    if target is None:
        return ACTION_NAMES.index(decision.alternative) if decision.alternative else None
    names = {name: i for i, name in enumerate(ACTION_NAMES)} | {str(Action(i)): i for i in range(4)}
    call = names.get(target, -1) if isinstance(target, str) else target
    if call not in range(4):
        raise RsrlError(f"no call {target!r}; calls are {', '.join(ACTION_NAMES)}")
    if ACTION_NAMES[call] == decision.call:
        raise RsrlError(f"{decision.call} is the call already made for lap {decision.lap}; ask for another one")
    return call
