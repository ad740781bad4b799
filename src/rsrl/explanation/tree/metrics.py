"""How well a tree's calls agree with a policy's. Stops are rare, so never stopping is accurate; macro-F1 and kappa do not reward it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.episodes import Calls, Episodes, Flags, Floats
from rsrl.explanation.tree.dataset import TreeEpisodes
from rsrl.state import ACTION_NAMES
from rsrl.strategists import Tree, made_legal

N_ACTIONS = len(ACTION_NAMES)


@dataclass(frozen=True)
class LabelFigures:
    """A tree's calls against the policy's, over many states.

    Attributes:
        states: how many.
        confusion: int64 [4, 4], rows are the policy's calls, columns the tree's.
        accuracy: share of states with the same call.
        majority: accuracy of always making the policy's commonest call.
        macro_f1: mean F1 over the calls that either of them makes.
        f1: by call, None for a call that neither makes.
        kappa: Cohen's kappa, agreement beyond chance.
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
    """Compare a tree's calls int8 [N] with the policy's [N]; N is at least 1."""
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


def tree_calls(tree: Tree, episodes: TreeEpisodes) -> Calls:
    """The tree's calls, made legal, in every state of episodes recorded with its rows; int8 [T, R]."""
    return _legal_calls(tree, episodes.rows, episodes.legal)


def postponed_tree_calls(tree: Tree, episodes: TreeEpisodes) -> Calls:
    """The tree's calls one lap later with each stop postponed, int8 [T, R]."""
    assert episodes.postponed is not None
    assert episodes.postponed_rows is not None
    return _legal_calls(tree, episodes.postponed_rows, episodes.postponed.legal)


def _legal_calls(tree: Tree, rows: Floats, legal: Flags) -> Calls:
    answers = tree.actions(rows.reshape(-1, rows.shape[2]))
    return made_legal(answers, legal.reshape(-1, N_ACTIONS)).reshape(rows.shape[:2])


def found_within_a_lap(episodes: Episodes, other: Calls, postponed: Calls) -> Flags:
    """Whether another caller makes each stop of the driver, with the same compound: a lap early, on the lap, or a lap late.

    Early and on the lap are read from the driver's race, late from that race with the stop postponed by a lap.

    Args:
        other: the other's calls in the driver's race, [T, R].
        postponed: the other's calls one lap later with each stop postponed, [T, R].

    Returns:
        bool [S], one for each stop of `episodes.calls`.
    """
    assert episodes.postponed is not None
    laps, races = np.nonzero((episodes.calls > 0) & episodes.running)
    compound = episodes.calls[laps, races]
    early = (laps > 0) & (other[np.maximum(laps - 1, 0), races] == compound)
    late = episodes.postponed.running[laps, races] & (postponed[laps, races] == compound)
    return early | (other[laps, races] == compound) | late


def agreement(episodes: Episodes, calls: Calls, within: float = 0.0) -> float:
    """Share of the decisions in which the calls [T, R] are the policy's, or, with `within` above 0, have at most that `regret`."""
    chosen = episodes.choices
    return float((regret(episodes, calls)[chosen] <= within).mean()) if within > 0 else float((calls == episodes.labels)[chosen].mean())


def regret(episodes: Episodes, calls: Calls) -> Floats:
    """The policy's value of its best legal call less its value of `calls` [T, R], float32 [T, R]."""
    best = np.where(episodes.legal, episodes.q, -np.inf).max(axis=2)
    return np.asarray(best - np.take_along_axis(episodes.q, calls[..., None].astype(np.int64), axis=2)[..., 0], np.float32)
