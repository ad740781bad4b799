"""VIPER: a tree that imitates a policy, fitted to the states that the tree itself reaches and chosen by the races it drives.

After Bastani, Pu and Solar-Lezama, Verifiable Reinforcement Learning via Policy Extraction (2018), with three additions: a legality shield,
columns that remember the laps before, and a choice among the iterations by finishing position.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.episodes import Calls, EpisodeRecorder, Floats
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.tree.dataset import (
    Samples,
    TreeEpisodes,
    TreeRecorder,
    clear_margin,
    samples_of,
    side_by_side,
    together,
    with_rows,
)
from rsrl.explanation.tree.metrics import agreement, label_figures, tree_calls
from rsrl.season import RaceRecord, race_hash
from rsrl.strategists import Tree, TreeStrategist, tree_columns, tree_from_classifier

FIT_SEED: Final = 2**41
SELECT_SEED: Final = 2**41 + 2**40
"""Added to the seed: races that trees are fitted to and chosen on. No evaluation, training or plan search uses them."""

STOP_WEIGHT: Final = 1.5
"""How often a state in which the policy stops counts."""

FIRST_BATCHES: Final = 4
"""Batches of races driven by the policy before the first tree, each as large as a tree's own batch."""

MOST_COLUMNS: Final = 32
"""Columns a tree is grown from: those that a large tree on the policy's own races uses most."""

WATCHED_RACES: Final = 384
"""Races that every iteration's tree drives, and on which its labels are measured, to choose among the iterations."""

FINALISTS: Final = 6
"""Trees with the best mean position on the watched races, among which the final races choose."""

FINAL_BATCHES: Final = 8
"""Batches of `WATCHED_RACES` final races."""

MIN_SAMPLES: Final = 5
"""Samples a leaf has at least."""

COMPOUND_LEAVES: Final = 4
"""Leaves of the second part of a two-part tree: which compound to fit."""

DEPTH_BATCHES: Final = 4
DEPTH_RACES: Final = 384
"""Batches, and races of each, that the trees of the depth curve are fitted to."""

Progress = Callable[[int, int], None]
"""Called with (iterations done, iterations in all)."""


@dataclass(frozen=True)
class Choice:
    """Which iteration's tree was chosen, by the final races.

    Attributes:
        iteration: of the chosen tree, 0 for the first.
        races: final races.
        difference: mean finishing position of the chosen tree less the policy's, on those races; standard_error: of it.
        best: least difference among the finalists.
    """

    iteration: int
    races: int
    difference: float
    standard_error: float
    best: float


@dataclass(frozen=True)
class FittedTree:
    """A fitted tree and its training curve.

    Attributes:
        tree: the chosen one; its `about` holds settings, curve and choice.
        curve: one entry an iteration: `accuracy` and `macro_f1` on races of the policy, `agreement` on the tree's own, mean `position` less
            the policy's on the same races, `leaves`, `depth`, `samples`.
        chosen: its iteration, 0 for the first.
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
        iterations: rounds of dataset aggregation; each fits one tree.
        races: driven by the tree of each round.
        leaves: most leaves of a tree.
        weighted: weight each state by its best less its worst legal value, as VIPER does.
        two_part: fit first when to stop, then which compound to fit.
        stop_weight: how often a state in which the policy stops counts.
        columns: names of the columns to read (`tree_columns`); None for all that the policy's feature set allows.
        seed: of the races.
    """
    names = tuple(columns) if columns is not None else tuple(c.name for c in tree_columns(policy.agent.feature_set))
    recorder = TreeRecorder(policy, record, car, names, races)
    first = [recorder.record(FIT_SEED + seed, i * races) for i in range(FIRST_BATCHES)]
    if len(names) > MOST_COLUMNS:
        names = _most_used(side_by_side(first), names, seed)
        first = [with_rows(episodes, names) for episodes in first]
        recorder = TreeRecorder(policy, record, car, names, races)
    clear, rng = clear_margin(side_by_side(first)), np.random.default_rng(seed)
    parts = [samples_of(episodes, clear, rng) for episodes in first]
    watcher = TreeRecorder(policy, record, car, names, WATCHED_RACES)
    watched = watcher.record(SELECT_SEED + seed, 0)
    trees, curve = [], []
    for i in range(iterations):
        samples = together(parts)
        tree = grow(samples, samples.weights(stop_weight, weighted), names, leaves, seed, two_part=two_part)
        trees.append(tree)
        curve.append(_figures(tree, watched, watcher.record(SELECT_SEED + seed, 0, tree)) | {"samples": float(len(samples.labels))})
        if i < iterations - 1:
            parts.append(samples_of(recorder.record(FIT_SEED + seed, (FIRST_BATCHES + i) * races, tree), clear, rng))
        if progress:
            progress(i + 1, iterations)
    choice = choose(trees, curve, watcher, SELECT_SEED + seed)
    settings: dict[str, Any] = {"iterations": iterations, "races": races, "leaves": leaves, "weighted": weighted, "two_part": two_part}
    settings |= {"stop_weight": stop_weight, "seed": seed}
    chosen = replace(
        _slim(trees[choice.iteration]), model=policy.name, model_hash=policy.hash, race=record.name, driver=record.cars[car].driver,
        race_hash=race_hash(record), about={"settings": settings, "curve": curve, "choice": vars(choice)},
    )  # fmt: skip
    return FittedTree(chosen, tuple(curve), choice.iteration)


def _slim(tree: Tree) -> Tree:
    """The same tree without the columns that it does not read."""
    inner = tree.feature >= 0
    used = np.unique(tree.feature[inner])
    number = np.searchsorted(used, tree.feature)
    return replace(tree, feature=np.where(inner, number, tree.feature).astype(np.int32), columns=tuple(tree.columns[i] for i in used))


def _most_used(episodes: TreeEpisodes, names: tuple[str, ...], seed: int) -> tuple[str, ...]:
    """The columns that a large tree on the policy's own races uses most, in their order."""
    from sklearn.tree import DecisionTreeClassifier

    samples = samples_of(episodes, clear_margin(episodes), np.random.default_rng(seed))
    large = DecisionTreeClassifier(max_leaf_nodes=256, min_samples_leaf=MIN_SAMPLES, random_state=seed)
    large.fit(samples.rows, samples.labels, sample_weight=samples.weights(STOP_WEIGHT, False))
    most: NDArray[np.int64] = np.sort(np.argsort(-large.feature_importances_, kind="stable")[:MOST_COLUMNS])
    return tuple(names[i] for i in most if large.feature_importances_[i] > 0)


def _figures(tree: Tree, by_policy: TreeEpisodes, by_tree: TreeEpisodes) -> dict[str, float]:
    calls, running = tree_calls(tree, by_policy), by_policy.running
    labels = label_figures(by_policy.labels[running], calls[running])
    return {
        "accuracy": labels.accuracy,
        "macro_f1": labels.macro_f1,
        "agreement": agreement(by_tree, by_tree.calls),
        "position": float((by_tree.outcome.position - by_policy.outcome.position).mean()),
        "leaves": float(len(tree.leaves)),
        "depth": float(tree.depth),
    }


def choose(trees: Sequence[Tree], curve: Sequence[Mapping[str, float]], watcher: TreeRecorder, seed: int) -> Choice:
    """The tree that drives best, and among those that drive as well the one most like the policy.

    The finalists have the best mean position on the watched races and drive further ones of the seed, paired with the policy. Among those
    within one standard error (paired) of the best finalist, the one with the highest macro-F1 on the policy's races is chosen.
    """
    batch, drives = watcher.batch, EpisodeRecorder(watcher.race_record, watcher.car, watcher.batch)
    entered = sorted(range(len(trees)), key=lambda i: (curve[i]["position"], -curve[i]["macro_f1"]))[:FINALISTS]
    calls: dict[int, list[Calls]] = {i: [] for i in entered}
    positions: dict[int, list[NDArray[np.int64]]] = {i: [] for i in entered}
    labels, own = [], []
    for part in range(1, FINAL_BATCHES + 1):
        by_policy = watcher.record(seed, part * batch)
        own.append(by_policy.outcome.position)
        labels.append(by_policy.labels[by_policy.running])
        for i in entered:
            calls[i].append(tree_calls(trees[i], by_policy)[by_policy.running])
            positions[i].append(drives.record(seed, part * batch, TreeStrategist(trees[i])).outcome.position)
    differences = {i: np.concatenate(positions[i]) - np.concatenate(own) for i in entered}
    best = min(entered, key=lambda i: float(differences[i].mean()))
    level = [i for i in entered if _not_behind(differences[i] - differences[best])]
    f1 = {i: label_figures(np.concatenate(labels), np.concatenate(calls[i])).macro_f1 for i in level}
    chosen = max(level, key=lambda i: f1[i])
    difference, races = differences[chosen], len(own) * batch
    error = float(difference.std(ddof=1)) / races**0.5
    return Choice(chosen, races, float(difference.mean()), error, float(differences[best].mean()))


def _not_behind(difference: NDArray[np.int64]) -> bool:
    return bool(difference.mean() <= difference.std(ddof=1) / len(difference) ** 0.5)


def grow(samples: Samples, weights: NDArray[np.float64], columns: Sequence[str], leaves: int, seed: int, *, two_part: bool = False) -> Tree:
    """A tree with at most `leaves` leaves and without questions that change no answer; `Tree.samples` counts the samples given."""
    if two_part:
        tree = _grow_two_parts(samples, weights, columns, leaves, seed)
    else:
        tree = _cart(samples.rows, samples.labels, weights, columns, leaves, seed).merged()
    return _counted(tree, samples)


def _counted(tree: Tree, samples: Samples) -> Tree:
    return tree.counted(samples.rows, samples.labels, samples.stands_for)


def _cart(rows: Floats, labels: Calls, weights: NDArray[np.float64], columns: Sequence[str], leaves: int, seed: int) -> Tree:
    """CART, the leaves with the largest gain split first."""
    from sklearn.tree import DecisionTreeClassifier

    classifier = DecisionTreeClassifier(max_leaf_nodes=leaves, min_samples_leaf=MIN_SAMPLES, random_state=seed)
    return tree_from_classifier(classifier.fit(rows, labels, sample_weight=weights), columns)


def _grow_two_parts(samples: Samples, weights: NDArray[np.float64], columns: Sequence[str], leaves: int, seed: int) -> Tree:
    """One tree for when to stop, and one for which compound to fit, grafted onto every leaf that stops and pruned to what occurs there.

    If `leaves` is too small for both, the tree is grown in one piece.
    """
    stops = samples.labels > 0
    if not stops.any():
        return _cart(samples.rows, samples.labels, weights, columns, leaves, seed)
    what = _cart(samples.rows[stops], samples.labels[stops], weights[stops], columns, COMPOUND_LEAVES, seed).merged()
    best, low, high = None, 2, leaves
    while low <= high:  # bisection: the largest first part that leaves room for the second
        parts = (low + high) // 2
        when = _cart(samples.rows, stops.astype(np.int8), weights, columns, parts, seed).merged()
        tree = _counted(_grafted(when, what), samples).without_empty().merged()
        if len(tree.leaves) <= leaves:
            best, low = tree, parts + 1
        else:
            high = parts - 1
    return _cart(samples.rows, samples.labels, weights, columns, leaves, seed) if best is None else best


def _grafted(when: Tree, what: Tree) -> Tree:
    """`when` with every leaf that stops replaced by `what`."""
    tree = when
    for leaf in when.leaves[when.action[when.leaves] > 0][::-1]:
        tree = _replaced(tree, int(leaf), what)
    return tree


def _replaced(tree: Tree, leaf: int, branch: Tree) -> Tree:
    """`tree` with one leaf replaced by `branch`; the nodes after it move back."""
    more = len(branch.feature) - 1

    def moved(nodes: NDArray[np.int32]) -> NDArray[np.int32]:
        return np.where(nodes > leaf, nodes + more, nodes)

    def put(name: str, old: NDArray, new: NDArray) -> NDArray:
        return np.concatenate([old[:leaf], new, old[leaf + 1 :]]).astype(getattr(tree, name).dtype)

    inner = branch.feature >= 0
    children: dict[str, Any] = {
        side: put(side, moved(getattr(tree, side)), np.where(inner, getattr(branch, side) + leaf, getattr(branch, side)))
        for side in ("left", "right")
    }
    others: dict[str, Any] = {
        name: put(name, getattr(tree, name), getattr(branch, name)) for name in ("feature", "threshold", "action", "samples")
    }
    return replace(tree, **children, **others)


def depth_curve(
    policy: ExplainedPolicy, record: RaceRecord, car: int, test: TreeEpisodes, columns: Sequence[str], depths: int
) -> list[dict[str, float]]:
    """Accuracy and macro-F1 of trees of depth 1 to `depths` without a limit on leaves, fitted to races that the policy drove.

    Args:
        test: races of another seed, driven by the policy, with rows of the columns.
    """
    from sklearn.tree import DecisionTreeClassifier

    recorder = TreeRecorder(policy, record, car, columns, DEPTH_RACES)
    batches = [recorder.record(FIT_SEED, i * DEPTH_RACES) for i in range(DEPTH_BATCHES)]
    clear, rng = clear_margin(batches[0]), np.random.default_rng(0)
    samples = together([samples_of(episodes, clear, rng) for episodes in batches])
    running, curve = test.running, []
    for depth in range(1, depths + 1):
        classifier = DecisionTreeClassifier(max_depth=depth, min_samples_leaf=MIN_SAMPLES, random_state=0)
        classifier.fit(samples.rows, samples.labels, sample_weight=samples.weights(STOP_WEIGHT, False))
        tree = tree_from_classifier(classifier, columns).merged()
        figures = label_figures(test.labels[running], tree_calls(tree, test)[running])
        curve.append({"depth": depth, "leaves": len(tree.leaves), "accuracy": figures.accuracy, "macro_f1": figures.macro_f1})
    return curve
