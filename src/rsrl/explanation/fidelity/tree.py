"""Fidelity of a surrogate tree: its calls, its stops and the races it drives itself, on races it was neither fitted to nor chosen on."""

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.episodes import Calls, EpisodeRecorder
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.tree.dataset import TreeEpisodes, TreeRecorder, side_by_side
from rsrl.explanation.tree.fit import depth_curve
from rsrl.explanation.tree.metrics import agreement, found_within_a_lap, label_figures, postponed_tree_calls, regret, tree_calls
from rsrl.explanation.tree.store import find_tree
from rsrl.season import RaceRecord, find_car
from rsrl.state import ACTION_NAMES
from rsrl.statistics import mean_interval
from rsrl.strategists import Tree, make_strategist

BATCH: Final = 384
RESAMPLES: Final = 400
OTHERS: Final = ("fixed", "heuristic")
PAPER: Final = {"accuracy": 0.926, "majority": 0.933, "macro_f1": 0.339, "kappa": 0.18, "stops_found": 0.15}
"""Figures of the paper's own tree, from its confusion matrix."""

Progress = Callable[[int, int], None]


def measure_tree(
    policy: ExplainedPolicy,
    record: RaceRecord,
    *,
    tree: Tree | None = None,
    car: int | None = None,
    races: int = 1920,
    seed: int = 7,
    others: Sequence[str] = OTHERS,
    within: float = 0.05,
    depths: int = 14,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Figures of a tree; intervals are 95 %, shares by a bootstrap over races.

    Args:
        tree: None for the one stored with the policy.
        car: None for the race's default one.
        races: rounded up to batches of `BATCH`.
        others: strategists compared with the tree on the same races.
        within: a call agrees if it costs at most so much by the policy's values.
        depths: greatest depth of the depth curve; 0 for none.

    Raises:
        RsrlError: there is no tree, or it is another model's.
    """
    called = find_car(record, None) if car is None else car
    tree = find_tree(policy, record, called) if tree is None else tree
    recorder = TreeRecorder(policy, record, called, tree.columns, BATCH, postpone=True)
    firsts = range(0, races, BATCH)
    total = (2 + len(others)) * len(firsts) + (1 if depths else 0)
    counted = _Counted(progress, total)
    by_policy = side_by_side([counted(recorder.record(seed, first)) for first in firsts])
    by_tree = side_by_side([counted(recorder.record(seed, first, tree)) for first in firsts])
    figures: dict[str, Any] = {
        "race": record.name,
        "driver": record.cars[called].driver,
        "races": len(by_policy.outcome.position),
        "seed": seed,
        "leaves": len(tree.leaves),
        "depth": tree.depth,
        "columns": len(tree.columns),
        "labels": _label_part(tree, by_policy, by_policy.labels),
        "stops": _stop_part(tree, by_policy),
        "own_states": _own_part(by_tree, within),
        "position": {"policy": float(by_policy.outcome.position.mean()), "tree": float(by_tree.outcome.position.mean())},
        "behind_policy": _mean(by_tree.outcome.position - by_policy.outcome.position),
        "invalid_share": float((~by_tree.outcome.valid & ~by_tree.outcome.retired).mean()),
        "paper": dict(PAPER),
    }
    plain = EpisodeRecorder(record, called, BATCH)
    for name in others:
        strategist = make_strategist(name, record, called)
        position = np.concatenate([counted(plain.record(seed, first, strategist)).outcome.position for first in firsts])
        figures["position"][name] = float(position.mean())
        figures[f"ahead_of_{name}"] = _mean(position - by_tree.outcome.position)
    figures["curve"] = list(tree.about.get("curve", ()))
    if depths:
        figures["depth_curve"] = counted(depth_curve(policy, record, called, by_policy, tree.columns, depths))
    return figures


class _Counted:
    """Passes values on and reports progress."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0

    def __call__(self, value: Any) -> Any:
        self._done += 1
        if self._progress:
            self._progress(self._done, self._total)
        return value


def _label_part(tree: Tree, driven: TreeEpisodes, answers: Calls) -> dict[str, Any]:
    """The tree's calls in the states of the policy's own races."""
    calls = tree_calls(tree, driven)
    there = driven.running
    figures = label_figures(answers[there], calls[there])
    by_race = np.zeros((there.shape[1], 4, 4))
    lap, race = np.nonzero(there)
    np.add.at(by_race, (race, answers[lap, race].astype(np.int64), calls[lap, race].astype(np.int64)), 1)
    resampled = [_scores(by_race[drawn].sum(axis=0)) for drawn in _resamples(len(by_race))]
    return figures.to_dict() | {f"{name}_ci95": _ends([s[name] for s in resampled]) for name in ("accuracy", "macro_f1", "kappa")}


def _scores(confusion: NDArray[np.float64]) -> dict[str, float]:
    n, hits = confusion.sum(), np.diag(confusion)
    rows, columns = confusion.sum(axis=1), confusion.sum(axis=0)
    chance = float(rows @ columns) / float(n) ** 2
    accuracy = float(hits.sum() / n)
    f1 = (2 * hits / np.maximum(rows + columns, 1))[rows + columns > 0]
    return {"accuracy": accuracy, "macro_f1": float(f1.mean()), "kappa": (accuracy - chance) / (1 - chance)}


def _stop_part(tree: Tree, driven: TreeEpisodes) -> dict[str, Any]:
    """The share of the policy's stops that the tree makes, on the same lap and within one lap."""
    calls = tree_calls(tree, driven)
    found = found_within_a_lap(driven, calls, postponed_tree_calls(tree, driven))
    lap, race = np.nonzero((driven.calls > 0) & driven.running)
    compound = driven.calls[lap, race]
    exact = calls[lap, race] == compound
    by_compound = {
        ACTION_NAMES[c]: {"stops": int((compound == c).sum()), "within_one_lap": float(found[compound == c].mean())}
        for c in (1, 2, 3)
        if (compound == c).any()
    }
    share, races = _share, driven.calls.shape[1]
    return {
        "stops": len(lap),
        "on_the_lap": share(exact, race, races),
        "any_compound_on_the_lap": share(calls[lap, race] > 0, race, races),
        "within_one_lap": share(found, race, races),
        "by_compound": by_compound,
    }


def _own_part(driven: TreeEpisodes, within: float) -> dict[str, Any]:
    """Agreement in the states that the tree reaches itself, and the share of its stops that the policy makes."""
    assert driven.postponed is not None
    late = np.where(driven.postponed.legal, driven.postponed.q, -np.inf).argmax(axis=2).astype(np.int8)
    shared = found_within_a_lap(driven, driven.labels, late)
    _, race = np.nonzero((driven.calls > 0) & driven.running)
    return {
        "agreement": agreement(driven, driven.calls),
        "agreement_within": agreement(driven, driven.calls, within),
        "within": within,
        "mean_regret": float(regret(driven, driven.calls)[driven.choices].mean()),
        "stops": len(race),
        "stops_shared_within_one_lap": _share(shared, race, driven.calls.shape[1]),
    }


def _resamples(races: int) -> list[NDArray[np.int64]]:
    rng = np.random.default_rng(0)
    return [rng.integers(races, size=races) for _ in range(RESAMPLES)]


def _share(flags: NDArray[np.bool_], race: NDArray[np.int64], races: int) -> dict[str, Any]:
    """Share of `flags` [S] that are set, with its interval by resampling their races [S]; None where there are no flags."""
    if not len(flags):
        return {"value": None, "ci95": None}
    hits, all_ = np.bincount(race, flags, races), np.bincount(race, minlength=races)
    drawn = [hits[i].sum() / max(all_[i].sum(), 1) for i in _resamples(races)]
    return {"value": float(flags.mean()), "ci95": _ends(drawn)}


def _mean(values: NDArray[np.int64]) -> dict[str, Any]:
    return {"value": float(values.mean()), "ci95": list(mean_interval(values))}


def _ends(values: Sequence[float]) -> list[float]:
    return [float(v) for v in np.quantile(values, (0.025, 0.975))]
