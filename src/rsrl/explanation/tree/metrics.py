"""How well a tree's answers agree with a policy's: beyond accuracy, which "never stop" wins where stops are rare."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.tree.driving import Calls, Driven, Flags
from rsrl.state import ACTION_NAMES
from rsrl.strategists import Tree, made_legal

N_ACTIONS = len(ACTION_NAMES)


@dataclass(frozen=True)
class LabelFigures:
    """Answers against the policy's, over many states.

    Attributes:
        states: how many.
        confusion: int64 [4, 4], rows the policy's call, columns the tree's.
        accuracy: share of states with the same call.
        majority: that of always answering the policy's commonest call.
        macro_f1: mean F1 over the calls that either of them makes; a call of neither has none.
        f1: by call, None for a call of neither.
        kappa: Cohen's: agreement beyond chance.
    """

    states: int
    confusion: NDArray[np.int64]
    accuracy: float
    majority: float
    macro_f1: float
    f1: Mapping[str, float | None]
    kappa: float

    def to_dict(self) -> dict[str, Any]:
        """In types that JSON has."""
        return vars(self) | {"confusion": self.confusion.tolist(), "f1": dict(self.f1)}


def label_figures(policy: Calls, tree: Calls) -> LabelFigures:
    """Figures of a tree's calls int8 [N] against the policy's [N]; N is one at least."""
    confusion = np.zeros((N_ACTIONS, N_ACTIONS), np.int64)
    np.add.at(confusion, (policy.astype(np.int64), tree.astype(np.int64)), 1)
    n, hits = confusion.sum(), np.diag(confusion)
    called = confusion.sum(axis=0) + confusion.sum(axis=1)
    f1 = 2 * hits / np.maximum(called, 1)
    chance = float((confusion.sum(axis=0) * confusion.sum(axis=1)).sum()) / float(n) ** 2
    accuracy = float(hits.sum() / n)
    return LabelFigures(
        states=int(n),
        confusion=confusion,
        accuracy=accuracy,
        majority=float(confusion.sum(axis=1).max() / n),
        macro_f1=float(f1[called > 0].mean()),
        f1={name: float(f1[i]) if called[i] else None for i, name in enumerate(ACTION_NAMES)},
        kappa=(accuracy - chance) / (1 - chance) if chance < 1 else 1.0,
    )


def tree_calls(tree: Tree, driven: Driven) -> Calls:
    """What the tree calls, made legal, in every state of races whose rows are its own; int8 [T, R]."""
    laps, races, columns = driven.rows.shape
    answers = tree.actions(driven.rows.reshape(-1, columns))
    return made_legal(answers, driven.legal.reshape(-1, N_ACTIONS)).reshape(laps, races)


def late_tree_calls(tree: Tree, driven: Driven) -> Calls:
    """What it calls where a stop was made one lap later, int8 [T, R]."""
    assert driven.late is not None
    assert driven.late_legal is not None
    answers = tree.actions(driven.late.reshape(-1, driven.late.shape[2]))
    return made_legal(answers, driven.late_legal.reshape(-1, N_ACTIONS)).reshape(driven.calls.shape)


def found_within_a_lap(driven: Driven, other: Calls, late: Calls) -> Flags:
    """Whether each stop the driver made would be made by the other with the same compound, a lap early, on the lap, or a lap late.

    The stops are those of `driven.calls`; early and on the lap are read from the driver's race, late from that race with the stop put off
    by a lap.

    Args:
        other: the other's calls in the driver's race, [T, R].
        late: the other's calls in the race with each stop put off, [T, R].

    Returns:
        bool [S], one for each stop.
    """
    laps, races = np.nonzero((driven.calls > 0) & driven.running)
    compound = driven.calls[laps, races]
    early = (laps > 0) & (other[np.maximum(laps - 1, 0), races] == compound)
    assert driven.late_running is not None
    after = driven.late_running[laps, races] & (late[laps, races] == compound)
    return early | (other[laps, races] == compound) | after


def agreement(driven: Driven, calls: Calls, within: float = 0.0) -> float:
    """Share of the choices in which the calls [T, R] are the policy's, or cost at most `within` of the policy's own value.

    The cost is what the policy itself gives the call less for, among the legal ones.
    """
    chosen = driven.choices
    return float((regret(driven, calls)[chosen] <= within).mean()) if within > 0 else float((calls == driven.answers)[chosen].mean())


def regret(driven: Driven, calls: Calls) -> NDArray[np.float32]:
    """What the policy gives calls [T, R] less for than its best legal one, float32 [T, R], in the policy's units."""
    best = np.where(driven.legal, driven.q, -np.inf).max(axis=2)
    return np.asarray(best - np.take_along_axis(driven.q, calls[..., None].astype(np.int64), axis=2)[..., 0], np.float32)
