"""The paper's three criteria of a reasonable strategy (its section on generalisability), for one strategy and as shares of races.

1. Between one and three stops.
2. A harder compound is used for more laps than a softer one: the hardest compound used against the softest, over all their stints.
3. Visual similarity to the Fixed Strategy or the state of the art, or a better mean position than both. The best other baseline of the
   track stands in for the state of the art. Similar: as many stops, the same compounds, each stop within `WINDOW_LAPS` laps. Better: the
   95 % interval of the paired difference lies above zero.

On the second criterion: read literally it rejects S-H@18-S@38, which the paper's own Fixed Strategy baseline drives at Bahrain, since two
sets of soft together run more laps than one set of hard. `harder_longer_a_set` compares mean laps per set and is reported beside it.

On the third: the paper asks for a better mean position than "Mercedes' SOTA or the Fixed Strategy models". If beating either of them is
enough, the criterion cannot fail: `fixed` is the worst baseline at nearly every track, and at the 13 tracks where it ran all 143 verdicts
on strategists other than `fixed` and `imitation` were positive. So both must be beaten, and by more than chance.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rsrl.evaluation.study.estimates import Run, Values, difference
from rsrl.results import CriteriaShares, Verdict, known
from rsrl.season import COMPOUNDS
from rsrl.simulator import Plan

FEWEST_STOPS, MOST_STOPS = 1, 3
WINDOW_LAPS: Final = 5


@dataclass(frozen=True)
class Reference:
    """A baseline to compare with.

    Attributes:
        strategies: its most common strategies.
        position: its finishing positions by race, from the first race of the study on.
    """

    name: str
    strategies: tuple[Plan, ...]
    position: Values

    def is_beaten_by(self, run: Run) -> bool:
        """Whether a run finishes ahead on the races they have in common, by a 95 % interval of the paired difference."""
        ends = known(difference([self.position], [run.position]).ci95)
        return ends is not None and ends[0] > 0


def few_stops(plan: Plan) -> bool:
    """Criterion 1."""
    return FEWEST_STOPS <= plan.stops <= MOST_STOPS


def harder_longer(plan: Plan, laps: int) -> bool:
    """Criterion 2 in a race of `laps`: more laps on the hardest compound used than on the softest; False with a single compound."""
    driven = _laps_by_compound(plan, laps)
    return driven[max(driven)] > driven[min(driven)]


def harder_longer_a_set(plan: Plan, laps: int) -> bool:
    """Criterion 2 with mean laps per set instead of total laps."""
    driven, sets = _laps_by_compound(plan, laps), Counter(plan.compounds)
    return driven[max(driven)] / sets[max(driven)] > driven[min(driven)] / sets[min(driven)]


def similar(plan: Plan, other: Plan) -> bool:
    """Visual similarity: as many stops, the same compounds in any order, each stop within `WINDOW_LAPS` laps of the other's."""
    if plan.stops != other.stops or set(plan.compounds) != set(other.compounds):
        return False
    return all(abs(a - b) <= WINDOW_LAPS for a, b in zip(plan.laps, other.laps, strict=True))


def judge(run: Run, references: Sequence[Reference]) -> Verdict | None:
    """Verdict on a run against references other than itself; None where no race was finished."""
    if not run.common:
        return None
    better = [r.name for r in references if r.is_beaten_by(run)]
    beats_all = len(better) == len(references)
    models = [plan for r in references for plan in r.strategies]
    common = Plan.parse(run.common[0].plan)
    finished = Counter(text for text, retired in zip(run.driven, run.retired, strict=True) if not retired)
    met: Counter[str] = Counter()
    for text, races in finished.items():
        met.update({name: races for name, ok in _met(Plan.parse(text), run.laps, models, beats_all).items() if ok})
    own = _met(common, run.laps, models, beats_all)
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
    """A common strategy in the paper's notation: `S[10,20]M` is soft to medium with the stop on laps 10 to 20."""
    compounds = [COMPOUNDS[c] for c in Plan.parse(plan).compounds]
    stops = [f"[{low}]" if low == high else f"[{low},{high}]" for low, high in windows]
    return compounds[0] + "".join(f"{stop}{compound}" for stop, compound in zip(stops, compounds[1:], strict=True))


def _met(plan: Plan, laps: int, models: Sequence[Plan], beats_all: bool) -> dict[str, bool]:
    """Which criteria a strategy meets."""
    met = {
        "few_stops": few_stops(plan),
        "harder_longer": harder_longer(plan, laps),
        "like_or_better": beats_all or any(similar(plan, other) for other in models),
    }
    return {**met, "reasonable": all(met.values()), "harder_longer_a_set": harder_longer_a_set(plan, laps)}


def _laps_by_compound(plan: Plan, laps: int) -> Counter[int]:
    edges = (0, *plan.laps, laps)
    driven: Counter[int] = Counter()
    for compound, begin, end in zip(plan.compounds, edges, edges[1:], strict=False):
        driven[compound] += end - begin
    return driven
