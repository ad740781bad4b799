"""Which of the iterations' trees: the one that drives best, and among those that drive as well as it, the one most like the policy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.explanation.tree.driving import Driver
from rsrl.explanation.tree.metrics import label_figures, tree_calls
from rsrl.strategists import Tree

FINALISTS: Final = 6
"""Trees that drive on in the second round."""

BATCHES: Final = 8
"""Batches of further races of the second round."""


@dataclass(frozen=True)
class Chosen:
    """The choice.

    Attributes:
        iteration: of the tree chosen.
        races: of the second round.
        difference: its mean finishing position less the policy's there.
        standard_error: of the difference.
        best: least difference among the finalists.
    """

    iteration: int
    races: int
    difference: float
    standard_error: float
    best: float


def choose(trees: Sequence[Tree], curve: Sequence[Mapping[str, float]], driver: Driver, seed: int) -> Chosen:
    """The finalists, best by the position they came to before, drive further races of the seed beside the policy.

    Among those within one standard error (paired) of the best, the one with the highest macro-F1 on the policy's races wins.
    """
    batch = driver.environment.batch
    entered = sorted(range(len(trees)), key=lambda i: (curve[i]["position"], -curve[i]["macro_f1"]))[:FINALISTS]
    labels: dict[int, list[np.ndarray]] = {i: [] for i in entered}
    positions: dict[int, list[np.ndarray]] = {i: [] for i in entered}
    truth, own = [], []
    for part in range(1, BATCHES + 1):
        policy = driver.drive(seed, part * batch)
        own.append(policy.position)
        truth.append(policy.answers[policy.running])
        for i in entered:
            labels[i].append(tree_calls(trees[i], policy)[policy.running])
            positions[i].append(driver.positions(seed, part * batch, trees[i]))
    differences = {i: np.concatenate(positions[i]) - np.concatenate(own) for i in entered}
    best = min(entered, key=lambda i: float(differences[i].mean()))
    level = [i for i in entered if _not_behind(differences[i] - differences[best])]
    f1 = {i: label_figures(np.concatenate(truth), np.concatenate(labels[i])).macro_f1 for i in level}
    chosen = max(level, key=lambda i: f1[i])
    difference = differences[chosen]
    races = len(difference)
    error = float(difference.std(ddof=1)) / races**0.5
    return Chosen(chosen, races, float(difference.mean()), error, float(differences[best].mean()))


def _not_behind(difference: np.ndarray) -> bool:
    return bool(difference.mean() <= difference.std(ddof=1) / len(difference) ** 0.5)
