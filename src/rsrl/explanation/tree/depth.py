"""How deep a tree must be: the paper's depth curve, remade."""

from collections.abc import Sequence

import numpy as np

from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.tree.dataset import clear_margin, samples_of, together
from rsrl.explanation.tree.driving import Driven, Driver
from rsrl.explanation.tree.fit import FIT_SEED, STOP_WEIGHT
from rsrl.explanation.tree.growing import MIN_SAMPLES
from rsrl.explanation.tree.metrics import label_figures, tree_calls
from rsrl.season import RaceRecord
from rsrl.strategists import tree_from_classifier

BATCHES = 4
RACES = 384


def depth_curve(
    policy: ExplainedPolicy, record: RaceRecord, car: int, test: Driven, columns: Sequence[str], depths: int
) -> list[dict[str, float]]:
    """Accuracy and macro-F1 of trees of depth 1 to `depths`, with as many leaves as they like, fitted to races the policy drove.

    Args:
        test: races of another seed, driven by the policy, with rows of the columns.
    """
    from sklearn.tree import DecisionTreeClassifier

    driver = Driver(policy, record, car, columns, RACES)
    driven = [driver.drive(FIT_SEED, i * RACES) for i in range(BATCHES)]
    clear, rng = clear_margin(driven[0]), np.random.default_rng(0)
    samples = together([samples_of(part, clear, rng) for part in driven])
    there, curve = test.running, []
    for depth in range(1, depths + 1):
        classifier = DecisionTreeClassifier(max_depth=depth, min_samples_leaf=MIN_SAMPLES, random_state=0)
        classifier.fit(samples.rows, samples.labels, sample_weight=samples.weights(STOP_WEIGHT, False))
        tree = tree_from_classifier(classifier, columns).merged()
        figures = label_figures(test.answers[there], tree_calls(tree, test)[there])
        curve.append({"depth": depth, "leaves": len(tree.leaves), "accuracy": figures.accuracy, "macro_f1": figures.macro_f1})
    return curve
