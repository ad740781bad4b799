"""Fidelity of counterfactuals, on random decisions toward the best and toward a random other call, as the paper drew them.

That the policy confirms every counterfactual shown holds by construction: the search returns no other. That figure checks the code, by
asking the policy once more past the search. How many decisions have a counterfactual, how many causes it changes and how often it holds in
rollouts are measurements.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.counterfactual.change import PAST_CAUSES, Change, RaceEditor, change_rows
from rsrl.explanation.counterfactual.explain import find_counterfactual
from rsrl.explanation.counterfactual.report import SearchResult
from rsrl.explanation.counterfactual.search import Counterfactual
from rsrl.explanation.counterfactual.space import Norm
from rsrl.explanation.episodes import EpisodeRecorder, Episodes, reach
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.tree.store import find_tree
from rsrl.season import RaceRecord, find_car
from rsrl.state import ACTION_NAMES, Observer
from rsrl.statistics import mean_interval, proportion_interval
from rsrl.strategists import Tree

PAPER: Final = {"features_changed": 1.63, "distance": 0.069}
"""Means over 100 random races, one random other call each; not checked on the policy."""

"""Of the Wilson interval."""

Progress = Callable[[int, int], None]


def measure_counterfactual(
    policy: ExplainedPolicy,
    record: RaceRecord,
    *,
    tree: Tree | None = None,
    car: int | None = None,
    races: int = 200,
    seed: int = 7,
    norm: Norm = "l1",
    simulate: int = 40,
    driven: int = 400,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Figures of counterfactuals; intervals are 95 %.

    From each race one decision with more than one legal call is drawn and explained twice: toward the best other call, which is what people
    ask, and toward one drawn at random, as in the paper. A policy may make a call in no race that it drives and still make it after a
    change of the past; the figures give the share of such targets.

    Args:
        tree: None for the one stored with the policy.
        simulate: races, the first ones, whose counterfactuals are also checked in rollouts.
        driven: races that the policy calls, which show the calls it ever makes and the states it meets.

    Raises:
        RsrlError: there is no tree, or it is another model's; fewer than two races.
    """
    if races < 2:
        raise RsrlError(f"races is {races}; fidelity needs at least two")
    called = find_car(record, None) if car is None else car
    tree = find_tree(policy, record, called) if tree is None else tree
    observer, rng = Observer(record, called), np.random.default_rng(seed)
    kinds: dict[str, list[dict[str, float]]] = {"best_other": [], "random": []}
    met = EpisodeRecorder(record, called, driven, policy).record(seed)
    legal_counts, call_counts = met.legal[met.choices].sum(axis=0), np.bincount(met.calls[met.choices], minlength=4)
    for race in range(races):
        moment = _decision(policy, record, called, seed, race, rng)
        q, legal = policy.q(moment), moment.legal
        call = int(policy.chosen(q[None], legal[None])[0])
        others = [a for a in range(4) if legal[a] and a != call]
        targets = {"best_other": max(others, key=lambda a: float(q[a])), "random": int(rng.choice(others))}
        for kind, target in targets.items():
            kinds[kind].append(_measured(policy, moment, tree, target, norm, observer, met, simulate=race < simulate))
        if progress:
            progress(race + 1, races)
    return {
        "race": record.name,
        "driver": record.cars[called].driver,
        "races": races,
        "seed": seed,
        "norm": norm,
        "driven": {
            "races": driven,
            "decisions": int(met.choices.sum()),
            **{n: {"legal": int(legal_counts[a]), "called": int(call_counts[a])} for a, n in enumerate(ACTION_NAMES)},
        },
        **{kind: _figures(rows) for kind, rows in kinds.items()},
        "paper": dict(PAPER),
    }


def _decision(policy: ExplainedPolicy, record: RaceRecord, car: int, seed: int, race: int, rng: np.random.Generator) -> Moment:
    """A decision of a race with at least two legal calls, drawn at random; where the car retires, one before that."""
    strategist = policy.strategist(record)
    last = record.laps
    while True:
        lap = int(rng.integers(1, last + 1))
        try:
            moment = reach(strategist, record, car, lap, seed=seed, race=race)
        except RsrlError:  # the car retired before that lap
            last = max(lap - 1, 1)
            continue
        if moment.legal.sum() > 1:
            return moment


def _measured(
    policy: ExplainedPolicy, moment: Moment, tree: Tree, target: int, norm: Norm, observer: Observer, met: Episodes, *, simulate: bool
) -> dict[str, float]:
    wall, busy = time.perf_counter(), time.thread_time()
    result = find_counterfactual(policy, moment, tree, target, norm, observer=observer)
    row = {"wall_ms": 1000.0 * (time.perf_counter() - wall), "processor_ms": 1000.0 * (time.thread_time() - busy)}
    row |= _of_leaf(result) | {
        "found": float(bool(result.found)),
        "called_when_driven": float((met.calls[met.choices] == target).any()),
        "target_in_tree": float(bool((tree.action[tree.leaves] == target).any())),
    }
    if result.found:
        best = result.found[0]
        row |= {"causes_changed": float((~np.isnan(best.row)).sum()), "distance": float(best.distances.sum())}
        if not policy.recurrent:
            row["confirmed_by_construction"] = float(_asked_again(policy, moment, best) == ACTION_NAMES[target])
        row |= {"reachable": float(best.change.reachable), "proposed_by_tree": float(best.from_leaf)}
        row |= {"forced": float(not best.legal[0]), "within_what_was_driven": float(met.covers(best.raw))}
        if simulate:
            share = find_counterfactual(policy, moment, tree, target, norm, simulate=True, observer=observer).share
            row |= {} if share is None else {"simulated_share": share.share}
    return row


def _asked_again(policy: ExplainedPolicy, moment: Moment, best: Counterfactual) -> str:
    """The call of a policy without memory in the edited race, which is edited once more and asked about past the search.

    Where the policy calls the laps until then, each of its calls is checked as well; "" where one differs from the search's.
    """
    change, editor = best.change, RaceEditor(moment.record, moment.car, moment.arrays)
    calls = np.zeros((1, moment.record.laps), np.int8)
    if change.laps_called:
        past = {name: value for name, value in change.parts.items() if name in PAST_CAUSES}
        for lap, call in best.stops_before:
            calls[0, lap] = call
        steps = [Change(**past, laps_called=n or None) for n in range(change.laps)]
        if [_call(policy, moment, editor, step, calls) for step in steps] != [ACTION_NAMES[c] for c in calls[0, : change.laps]]:
            return ""
    return _call(policy, moment, editor, change, calls)


def _call(policy: ExplainedPolicy, moment: Moment, editor: RaceEditor, change: Change, calls: NDArray[np.int8]) -> str:
    edited = editor.edit(change_rows([change]), calls)
    raw = np.concatenate([moment.raw[:-1], edited.raw])
    return policy.decide(replace(moment, raw=raw, legal=edited.legal[0])).call


def _of_leaf(result: SearchResult) -> dict[str, float]:
    if result.leaves is None or not result.leaves.points:
        return {"leaf": 0.0}
    nearest = result.leaves.points[0]
    return {
        "leaf": 1.0,
        "leaf_features_changed": float(nearest.moved.sum()),
        "leaf_distance": float(nearest.distance.sum()),
        "leaf_confirmed_on_last_lap": float(result.confirmed_on_last_lap[0]),
        "leaf_names_a_cause": float(result.names_a_cause[0]),
        "leaf_confirmed_consistent": float(result.confirmed_consistent[0]),
        "any_leaf_confirmed_on_last_lap": float(result.confirmed_on_last_lap.any()),
        "any_leaf_confirmed_consistent": float(result.confirmed_consistent.any()),
    }


SHARES: Final = (
    "found", "confirmed_by_construction", "reachable", "forced", "within_what_was_driven", "called_when_driven", "target_in_tree",
    "proposed_by_tree", "leaf", "leaf_names_a_cause", "leaf_confirmed_on_last_lap", "leaf_confirmed_consistent",
    "any_leaf_confirmed_on_last_lap", "any_leaf_confirmed_consistent",
)  # fmt: skip
MEANS: Final = ("causes_changed", "distance", "leaf_features_changed", "leaf_distance", "simulated_share")


def _figures(rows: Sequence[dict[str, float]]) -> dict[str, Any]:
    figures: dict[str, Any] = {"decisions": len(rows)}
    figures |= {name: share_of([r[name] for r in rows if name in r]) for name in SHARES}
    figures |= {name: mean_of([r[name] for r in rows if name in r]) for name in MEANS}
    figures["found_where_the_tree_makes_the_call"] = share_of([r["found"] for r in rows if r["target_in_tree"]])
    figures["found_where_called_when_driven"] = share_of([r["found"] for r in rows if r["called_when_driven"]])
    figures["found_where_never_called_when_driven"] = share_of([r["found"] for r in rows if not r["called_when_driven"]])
    for name, called in (("reachable_where_called_when_driven", 1.0), ("reachable_where_never_called_when_driven", 0.0)):
        figures[name] = share_of([r["reachable"] for r in rows if r["found"] and r["called_when_driven"] == called])
    figures["found_and_reachable"] = share_of([r["found"] * r.get("reachable", 0.0) for r in rows])
    for name in ("wall_ms", "processor_ms"):
        times = np.array([r[name] for r in rows[1:]])  # the first one fills caches
        figures[name] = {"median": float(np.median(times)), "p95": float(np.quantile(times, 0.95)), "mean": float(times.mean())}
    return figures


def share_of(values: Sequence[float]) -> dict[str, Any]:
    """A share with its Wilson interval; None where there are no values."""
    n = len(values)
    if n == 0:
        return {"value": None, "ci95": None, "n": 0}
    share = float(np.mean(values))
    return {"value": share, "ci95": proportion_interval(share, n), "n": n}


def mean_of(values: Sequence[float]) -> dict[str, Any]:
    """A mean with its interval by Student's t; None where there are no values, no interval for one."""
    data: NDArray[np.float64] = np.array(values, np.float64)
    if not len(data):
        return {"value": None, "ci95": None, "n": 0}
    return {"value": float(data.mean()), "ci95": list(mean_interval(data)) if len(data) > 1 else None, "n": len(data)}
