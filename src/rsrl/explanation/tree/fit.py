"""VIPER: a tree that stands for a policy, fitted to the states the tree itself reaches and chosen by the races it drives.

After Bastani, Pu and Solar-Lezama, Verifiable Reinforcement Learning via Policy Extraction (2018), with a legality shield, a memory for the
tree, and a choice that looks at the finishing position.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.tree.choosing import Chosen, choose
from rsrl.explanation.tree.dataset import clear_margin, samples_of, together
from rsrl.explanation.tree.driving import Driven, Driver, joined
from rsrl.explanation.tree.growing import grow
from rsrl.explanation.tree.metrics import agreement, label_figures, tree_calls
from rsrl.season import RaceRecord, race_hash
from rsrl.strategists import Tree, tree_columns

FIT_SEED: Final = 2**41
SELECT_SEED: Final = 2**41 + 2**40
"""Races trees are fitted to and chosen on: these and the seed asked for; beyond seeds of evaluations, training and plan searches."""

STOP_WEIGHT: Final = 1.5
"""How often a state in which the policy stops counts."""

FIRST_BATCHES: Final = 4
"""Batches of races driven by the policy before the first tree, in sizes of a tree's own batch."""

MOST_COLUMNS: Final = 32
"""Columns a tree is grown from: those that a large tree on the policy's own races uses most."""

WATCHED_RACES: Final = 384
"""Races on which every iteration's tree is driven and its labels are measured, to choose among them."""

Progress = Callable[[int, int], None]
"""Called with (iterations done, iterations in all)."""


@dataclass(frozen=True)
class FittedTree:
    """A tree with how it came about.

    Attributes:
        tree: the one chosen; its `about` holds settings, curve and choice.
        curve: one entry an iteration: `accuracy` and `macro_f1` on races of the policy, `agreement` on the tree's own, mean `position` less
            the policy's on the same races, `leaves`, `depth`, `samples`.
        chosen: iteration the tree is of, 0 for the first.
    """

    tree: Tree
    curve: tuple[Mapping[str, float], ...]
    chosen: int


def fit_tree(
    policy: ExplainedPolicy,
    record: RaceRecord,
    car: int,
    *,
    iterations: int = 50,
    races: int = 96,
    leaves: int = 48,
    weighted: bool = False,
    two_part: bool = False,
    stop_weight: float = STOP_WEIGHT,
    columns: Sequence[str] | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> FittedTree:
    """Fit a tree to a policy on races of one car.

    Args:
        iterations: rounds of aggregation; one tree each.
        races: driven by each round's tree.
        leaves: a tree has at most.
        weighted: states count by what is at stake in them, best less worst legal value, as VIPER has it.
        two_part: first when to stop, then what to fit.
        stop_weight: how often a state in which the policy stops counts.
        columns: names of the columns to read (`tree_columns`); None for all that the policy's feature set allows.
        seed: names the races.
    """
    names = tuple(columns) if columns is not None else tuple(c.name for c in tree_columns(policy.agent.feature_set))
    names = _useful(policy, record, car, names, races, seed) if len(names) > MOST_COLUMNS else names
    driver = Driver(policy, record, car, names, races)
    first = [driver.drive(FIT_SEED + seed, i * races) for i in range(FIRST_BATCHES)]
    clear, rng = clear_margin(joined(first)), np.random.default_rng(seed)
    parts = [samples_of(driven, clear, rng) for driven in first]
    watcher = Driver(policy, record, car, names, WATCHED_RACES)
    watched = watcher.drive(SELECT_SEED + seed, 0)
    trees, curve = [], []
    for i in range(iterations):
        samples = together(parts)
        tree = grow(samples, samples.weights(stop_weight, weighted), names, leaves, seed, two_part=two_part)
        trees.append(tree)
        curve.append(_figures(tree, watched, watcher.drive(SELECT_SEED + seed, 0, tree)) | {"samples": float(len(samples.labels))})
        if i < iterations - 1:
            parts.append(samples_of(driver.drive(FIT_SEED + seed, (FIRST_BATCHES + i) * races, tree), clear, rng))
        if progress:
            progress(i + 1, iterations)
    picked = choose(trees, curve, watcher, SELECT_SEED + seed)
    settings: dict[str, Any] = {"iterations": iterations, "races": races, "leaves": leaves, "weighted": weighted, "two_part": two_part}
    settings |= {"stop_weight": stop_weight, "seed": seed}
    return _fitted(policy, record, car, trees[picked.iteration], curve, picked, settings)


def _fitted(
    policy: ExplainedPolicy,
    record: RaceRecord,
    car: int,
    tree: Tree,
    curve: list[dict[str, float]],
    picked: Chosen,
    settings: dict[str, Any],
) -> FittedTree:
    about = {"settings": settings, "curve": curve, "choice": vars(picked)}
    named = replace(
        _slim(tree), model=policy.name, model_hash=policy.hash, race=record.name, driver=record.cars[car].driver,
        race_hash=race_hash(record), about=about,
    )  # fmt: skip
    return FittedTree(named, tuple(curve), picked.iteration)


def _slim(tree: Tree) -> Tree:
    """The tree without the columns it never asks about; it answers the same."""
    inner = tree.feature >= 0
    used = np.unique(tree.feature[inner])
    number = np.searchsorted(used, tree.feature)
    return replace(tree, feature=np.where(inner, number, tree.feature).astype(np.int32), columns=tuple(tree.columns[i] for i in used))


def _useful(policy: ExplainedPolicy, record: RaceRecord, car: int, names: tuple[str, ...], races: int, seed: int) -> tuple[str, ...]:
    """The columns that a large tree on the policy's own races uses most, in their order."""
    from sklearn.tree import DecisionTreeClassifier

    driver = Driver(policy, record, car, names, races)
    driven = joined([driver.drive(FIT_SEED + seed, i * races) for i in range(FIRST_BATCHES)])
    samples = samples_of(driven, clear_margin(driven), np.random.default_rng(seed))
    large = DecisionTreeClassifier(max_leaf_nodes=256, min_samples_leaf=5, random_state=seed)
    large.fit(samples.rows, samples.labels, sample_weight=samples.weights(STOP_WEIGHT, False))
    most: NDArray[np.int64] = np.sort(np.argsort(-large.feature_importances_, kind="stable")[:MOST_COLUMNS])
    return tuple(names[i] for i in most if large.feature_importances_[i] > 0)


def _figures(tree: Tree, policy_drives: Driven, tree_drives: Driven) -> dict[str, float]:
    calls = tree_calls(tree, policy_drives)
    there = policy_drives.running
    labels = label_figures(policy_drives.answers[there], calls[there])
    return {
        "accuracy": labels.accuracy,
        "macro_f1": labels.macro_f1,
        "agreement": agreement(tree_drives, tree_drives.calls),
        "position": float((tree_drives.position - policy_drives.position).mean()),
        "leaves": float(len(tree.leaves)),
        "depth": float(tree.depth),
    }
