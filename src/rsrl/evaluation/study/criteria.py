"""The paper's three criteria of a reasonable strategy (its section on generalisability), on one strategy and over races.

1. between one and three stops;
2. a harder compound is used for more laps than a softer one: the hardest used against the softest used, all their laps together;
3. visual similarity to, or a better mean position than, the Fixed Strategy or the state of the art, for the latter here the best baseline
   of the track. Similar: as many stops, the same compounds, each stop within `WINDOW_LAPS` laps.

Read literally, the second faults S-H@18-S@38, a strategy that the paper's own Fixed Strategy baseline drives at Bahrain: two sets of
soft run for more laps than one of hard. `harder_longer_a_set` compares laps a set, and is told beside it.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rsrl.evaluation.study.estimates import Run
from rsrl.results import CriteriaShares, Verdict
from rsrl.season import COMPOUNDS
from rsrl.simulator import Plan

FEWEST_STOPS, MOST_STOPS = 1, 3
WINDOW_LAPS: Final = 5


@dataclass(frozen=True)
class Reference:
    """A baseline to compare with: its name, its commonest strategies and its mean position."""

    name: str
    strategies: tuple[Plan, ...]
    mean_position: float


def few_stops(plan: Plan) -> bool:
    """Criterion 1."""
    return FEWEST_STOPS <= plan.stops <= MOST_STOPS


def harder_longer(plan: Plan, laps: int) -> bool:
    """Criterion 2: the hardest compound used is driven for more laps than the softest, in a race of `laps`; one compound alone never is."""
    driven = _laps_by_compound(plan, laps)
    return driven[max(driven)] > driven[min(driven)]


def harder_longer_a_set(plan: Plan, laps: int) -> bool:
    """The same by mean laps of a set."""
    driven, sets = _laps_by_compound(plan, laps), Counter(plan.compounds)
    return driven[max(driven)] / sets[max(driven)] > driven[min(driven)] / sets[min(driven)]


def similar(plan: Plan, other: Plan) -> bool:
    """As many stops, the same compounds in whatever order, and each stop within `WINDOW_LAPS` laps of the other's."""
    if plan.stops != other.stops or set(plan.compounds) != set(other.compounds):
        return False
    return all(abs(a - b) <= WINDOW_LAPS for a, b in zip(plan.laps, other.laps, strict=True))


def judge(run: Run, mean_position: float, references: Sequence[Reference]) -> Verdict | None:
    """Criteria of a run against references other than itself; None where no race was finished."""
    if not run.common:
        return None
    better = [r.name for r in references if mean_position < r.mean_position]
    models = [plan for r in references for plan in r.strategies]
    common = Plan.parse(run.common[0].plan)
    finished = Counter(text for text, retired in zip(run.driven, run.retired, strict=True) if not retired)
    met: Counter[str] = Counter()
    for text, races in finished.items():
        met.update({name: races for name, ok in _met(Plan.parse(text), run.laps, models, bool(better)).items() if ok})
    own = _met(common, run.laps, models, bool(better))
    shares = {name: met[name] / finished.total() for name in own}
    return Verdict(
        strategy=str(common),
        share=run.common[0].share,
        few_stops=own["few_stops"],
        harder_longer=own["harder_longer"],
        like_or_better=own["like_or_better"] if references else None,
        reasonable=own["reasonable"] if references else None,
        harder_longer_a_set=own["harder_longer_a_set"],
        similar_to=tuple(r.name for r in references if any(similar(common, plan) for plan in r.strategies)),
        better_than=tuple(better),
        shares=CriteriaShares(
            few_stops=shares["few_stops"],
            harder_longer=shares["harder_longer"],
            like_or_better=shares["like_or_better"] if references else None,
            reasonable=shares["reasonable"] if references else None,
            harder_longer_a_set=shares["harder_longer_a_set"],
        ),
    )


def window_text(plan: str, windows: Sequence[Sequence[int]]) -> str:
    """A common strategy as the paper writes it: `S[10,20]M` is soft to medium, the stop on laps 10 to 20."""
    compounds = [COMPOUNDS[c] for c in Plan.parse(plan).compounds]
    stops = [f"[{low}]" if low == high else f"[{low},{high}]" for low, high in windows]
    return compounds[0] + "".join(f"{stop}{compound}" for stop, compound in zip(stops, compounds[1:], strict=True))


def _met(plan: Plan, laps: int, models: Sequence[Plan], better: bool) -> dict[str, bool]:
    """Which criteria a strategy meets."""
    met = {
        "few_stops": few_stops(plan),
        "harder_longer": harder_longer(plan, laps),
        "like_or_better": better or any(similar(plan, other) for other in models),
    }
    return {**met, "reasonable": all(met.values()), "harder_longer_a_set": harder_longer_a_set(plan, laps)}


def _laps_by_compound(plan: Plan, laps: int) -> Counter[int]:
    edges = (0, *plan.laps, laps)
    driven: Counter[int] = Counter()
    for compound, begin, end in zip(plan.compounds, edges, edges[1:], strict=False):
        driven[compound] += end - begin
    return driven
