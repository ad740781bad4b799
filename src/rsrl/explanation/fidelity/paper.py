"""The paper's reading of lap 10 of Bahrain 2023, beside the answers to the same questions here."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from rsrl.explanation.attribution import explain_attribution
from rsrl.explanation.counterfactual import explain_counterfactual
from rsrl.explanation.episodes import EpisodeRecorder
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Explanation
from rsrl.season import COMPOUND_NAMES, RaceRecord
from rsrl.state import ACTION_NAMES, FEATURES
from rsrl.strategists import Tree

RACE: Final = "bahrain-2023"
LAP: Final = 10
VERSTAPPEN: Final = "VER"
REAL_STOP: Final = (14, "soft")
"""Lap and tyre of his first stop, according to the paper."""

SOFT: Final = 1
RACES: Final = 100
NEAR_LAPS: Final = 2
TOP: Final = 3
"""The paper's two dominant features are looked for among the first three here."""

LAP_COLUMNS: Final = frozenset(f.name for f in FEATURES if f.group == "laps")
LAP_FEATURES: Final = frozenset(f.text for f in FEATURES if f.group == "laps")
GAP_FEATURES: Final = frozenset(f.text for f in FEATURES if f.group == "gap ahead")


@dataclass(frozen=True)
class FirstStops:
    """First stops of a driver over simulated races that the policy calls; laps int64 [n], compounds int64 [n], 0 soft."""

    driver: str
    races: int
    laps: np.ndarray[tuple[int], np.dtype[np.int64]]
    compounds: np.ndarray[tuple[int], np.dtype[np.int64]]


def first_stops(policy: ExplainedPolicy, record: RaceRecord, car: int, *, races: int = RACES, seed: int = 0) -> FirstStops:
    """First stops of races that the policy calls; a race without a stop is left out."""
    episodes = EpisodeRecorder(record, car, races).record(seed, driver=policy.strategist(record))
    stops = episodes.running & (episodes.calls > 0)
    stopped = np.flatnonzero(stops.any(axis=0))
    first = stops[:, stopped].argmax(axis=0)
    return FirstStops(record.cars[car].driver, races, first + 1, episodes.calls[first, stopped].astype(np.int64) - 1)


def read_beside(policy: ExplainedPolicy, moment: Moment, made: Sequence[Explanation], tree: Tree | None = None) -> list[dict[str, Any]]:
    """The table for lap 10 of Bahrain: the tree's path from `made`, with an attribution and a counterfactual like the paper's."""
    compared = [one for one in made if one.method == "tree"]
    compared.append(explain_attribution(policy, moment, level="feature", background="average"))
    if moment.legal[SOFT] and policy.decide(moment).call != ACTION_NAMES[SOFT]:
        compared.append(explain_counterfactual(policy, moment, tree, target=ACTION_NAMES[SOFT]))
    cars = dict.fromkeys((moment.record.car_index(VERSTAPPEN), moment.car))
    return beside_the_paper(compared, [first_stops(policy, moment.record, car) for car in cars])


def beside_the_paper(explanations: Sequence[Explanation], stops: Sequence[FirstStops]) -> list[dict[str, Any]]:
    """A row for each of the paper's readings that can be made here: question, paper, ours, agrees (None where there is no yes or no).

    Args:
        explanations: of lap 10; the attribution is by features against the average event, like the paper's.
        stops: of Verstappen, and of the driver explained.
    """
    by_method = {one.method: one for one in explanations}
    rows = [readings(by_method[method]) for method, readings in READINGS.items() if method in by_method]
    return [*(row for found in rows for row in found), *(_stops(one) for one in stops if len(one.laps))]


def _row(question: str, paper: str, ours: str, agrees: bool | None) -> dict[str, Any]:
    return {"question": question, "paper": paper, "ours": ours, "agrees": agrees}


def _attribution(one: Explanation) -> list[dict[str, Any]]:
    order = [str(one.labels[i]) for i in np.argsort(-np.abs(one.values), kind="stable")]
    top = ", ".join(order[:TOP])
    return [
        _row("most influential", "lap number", f"{_rank(order, LAP_FEATURES)}; top {TOP}: {top}", bool({*order[:TOP]} & LAP_FEATURES)),
        _row("does it look at the gap ahead?", "gap ahead dominant", _rank(order, GAP_FEATURES), bool({*order[:TOP]} & GAP_FEATURES)),
    ]


def _rank(order: Sequence[str], wanted: frozenset[str]) -> str:
    """Rank of the first of some features."""
    for place, name in enumerate(order, 1):
        if name in wanted:
            return f"{name} is number {place} of {len(order)}"
    return "the policy does not read it"


def _tree(one: Explanation) -> list[dict[str, Any]]:
    names = [str(name).partition("=")[0] for name in one.columns["feature"]]
    conditions = [label for label, name in zip(one.labels, names, strict=True) if name in LAP_COLUMNS]
    ours = "; ".join(conditions) if conditions else f"no condition on it, among {len(one.labels)}"
    return [_row("does the tree ask for the lap?", "race progress <= 0.263 (lap 15), one of 11 conditions", ours, bool(conditions))]


def _counterfactual(one: Explanation) -> list[dict[str, Any]]:
    ours = one.sentences[0] if one.sentences else one.summary()
    return [_row("what would make it box for soft?", "4.503 more laps, to lap 14; not checked on the policy", ours, None)]


READINGS: Final[Mapping[str, Callable[[Explanation], list[dict[str, Any]]]]] = {
    "attribution": _attribution,
    "tree": _tree,
    "counterfactual": _counterfactual,
}


def _stops(stops: FirstStops) -> dict[str, Any]:
    lap, tyre = REAL_STOP
    low, middle, high = np.quantile(stops.laps, (0.1, 0.5, 0.9))
    shares = np.bincount(stops.compounds, minlength=3) / len(stops.compounds)
    fitted = int(shares.argmax())
    near = np.abs(stops.laps - lap) <= NEAR_LAPS
    ours = (
        f"{stops.driver} first boxes on lap {middle:.0f} (10 to 90 %: {low:.0f} to {high:.0f}), in {100 * shares[fitted]:.0f} % for "
        f"{COMPOUND_NAMES[fitted]}; within {NEAR_LAPS} laps of {lap} in {100 * near.mean():.0f} % of {stops.races} races"
    )
    agrees = bool(abs(middle - lap) <= NEAR_LAPS and COMPOUND_NAMES[fitted] == tyre)
    return _row(f"does {stops.driver} stop as Verstappen did?", f"Verstappen boxed on lap {lap} for {tyre}", ours, agrees)
