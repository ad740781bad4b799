"""What would have to be different for another call: the smallest change of causes under which the policy itself makes it."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.attribution.values import single_blas_thread
from rsrl.explanation.counterfactual.change import CAUSE, CAUSES, Change, RaceEditor, change_rows
from rsrl.explanation.counterfactual.costs import Costs
from rsrl.explanation.counterfactual.grid import Grid
from rsrl.explanation.counterfactual.leaves import confirmed_on_last_lap, nearest_leaves
from rsrl.explanation.counterfactual.nearest import Norm
from rsrl.explanation.counterfactual.query import PolicyQuery
from rsrl.explanation.counterfactual.refining import Counterfactual
from rsrl.explanation.counterfactual.report import LEVELS, Level, Outcome, only_one, told, told_of_last_lap
from rsrl.explanation.counterfactual.rollout_check import Share, simulated_share
from rsrl.explanation.counterfactual.search import Search
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Decision, Explanation
from rsrl.state import ACTION_NAMES, COLUMN, Action, Observer
from rsrl.strategists import Tree

Floats = NDArray[np.float32]
OFTEN: Final = 0.5
"""Share of runs from which on a counterfactual counts as simulated."""

_NONE: Final[NDArray[np.bool_]] = np.zeros(0, np.bool_)
_NO_CALLS: Final[NDArray[np.int8]] = np.zeros(0, np.int8)


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
) -> Outcome:
    """Look for the smallest change under which the policy calls `target`; every candidate is checked on the policy."""
    with single_blas_thread():  # products this small are slower on several, and bits would depend on how many
        return _find(policy, moment, tree, target, norm, simulate, observer, seed)


def _find(
    policy: ExplainedPolicy,
    moment: Moment,
    tree: Tree | None,
    target: int,
    norm: Norm,
    simulate: bool,
    observer: Observer | None,
    seed: int,
) -> Outcome:
    asker = PolicyQuery(policy, moment, RaceEditor(moment.record, moment.car, moment.arrays, observer))
    ends = max(int(moment.raw[-1, COLUMN["laps_left"]]), 1)
    calls = asker.calls_of(change_rows([Change(laps_called=1)]))
    grid = Grid(moment.raw[-1], target, _NO_CALLS if calls is None else calls[0])
    costs = Costs(moment.record, policy.agent.feature_set, moment.raw[-1], *_expected(asker, ends))
    leaves, last_lap, consistent, causal = None, _NONE, _NONE, _NONE
    rows = np.zeros((0, len(CAUSES)), np.float32)
    if tree is not None:
        leaves = nearest_leaves(tree, moment, policy.agent.feature_set, target, norm)
        last_lap = confirmed_on_last_lap(asker, leaves, target)
        rows = np.concatenate([rows, *(grid.of_leaf(f, leaves.space) for f in leaves.found)])
        causal = np.array(~np.isnan(rows).all(axis=1), np.bool_)
        consistent = asker(rows).says(target) & causal if len(rows) else consistent
        rows = rows[consistent]
    found = Search(asker, costs, target, norm, grid, rows).run()
    share = None
    if simulate and found:
        found, share = _most_often(asker, found, target, seed)
    return Outcome(leaves, last_lap, consistent, causal, tuple(found), share, asker.asked)


def _expected(asker: PolicyQuery, ends: int) -> tuple[Floats, Floats]:
    """Raw rows of the laps from now on, the first is now: staying out, and as the policy calls, float32 [ends, RAW_SIZE] each."""
    steps = np.full((2, ends, len(CAUSES)), np.nan, np.float32)
    steps[0, 1:, CAUSE["laps_later"]] = steps[1, 1:, CAUSE["laps_called"]] = np.arange(1, ends)
    rows = steps.reshape(2 * ends, len(CAUSES))
    raw = asker.alterer(rows, asker.calls_of(rows)).raw
    return raw[:ends], raw[ends:]


def _most_often(asker: PolicyQuery, found: list[Counterfactual], target: int, seed: int) -> tuple[list[Counterfactual], Share | None]:
    """The first of the candidates that holds in most runs put in front; where none does, they stay as they are."""
    first: Share | None = None
    for i, one in enumerate(found):
        share = simulated_share(asker, one.row, one.starts, target, seed=seed)
        if share is not None and share.share >= OFTEN:
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
        norm: "l0", "l1" or "l2": how distances are summed where as many causes change.
        level: the check that what is shown has passed. "last-lap": a leaf's features put into the last row; "consistent": the change put
            into the race, all that follows computed anew; "simulated": besides, in what share of runs the call is then made.
        observer: of the record and car, where there is one.
        seed: of the runs.

    Raises:
        RsrlError: an unknown call, norm or level; the call asked for is the one made; a tree of another model; "last-lap" without a tree.
    """
    decision = policy.decide(moment)
    if norm not in ("l0", "l1", "l2") or level not in LEVELS:
        raise RsrlError(f"counterfactual: no norm {norm!r} with level {level!r}; norms are l0, l1, l2 and levels {', '.join(LEVELS)}")
    if tree is not None and tree.model_hash and tree.model_hash != policy.hash:
        raise RsrlError(f"the tree is of another model, {tree.model_hash}; the policy asked for is {policy.hash}; fit the tree again")
    wanted = _target(decision, target)
    if wanted is None:
        return only_one(decision)
    if level == "last-lap" and tree is None:
        raise RsrlError("a counterfactual checked on the last lap alone needs a tree; fit one, or ask for the level consistent")
    outcome = find_counterfactual(policy, moment, tree, wanted, norm, simulate=level == "simulated", observer=observer, seed=seed)
    if level == "last-lap":
        return told_of_last_lap(decision, wanted, norm, outcome)
    return told(decision, moment.driver, wanted, norm, level, outcome)


def _target(decision: Decision, target: str | int | None) -> int | None:
    """The call asked for; None where there is no other legal call."""
    if target is None:
        return ACTION_NAMES.index(decision.alternative) if decision.alternative else None
    names = {name: i for i, name in enumerate(ACTION_NAMES)} | {str(Action(i)): i for i in range(4)}
    wanted = names.get(target, -1) if isinstance(target, str) else target
    if wanted not in range(4):
        raise RsrlError(f"no call {target!r}; calls are {', '.join(ACTION_NAMES)}")
    if ACTION_NAMES[wanted] == decision.call:
        raise RsrlError(f"{decision.call} is the call already made for lap {decision.lap}; ask for another one")
    return wanted
