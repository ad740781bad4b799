"""What `rsrl plan` says before a race beside the strategies published then and what its top ten ran."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from rsrl.calibration.choices import CarChoice
from rsrl.evaluation.backtest.field_choice import most
from rsrl.evaluation.backtest.shipped_races import ShippedRace
from rsrl.results import Number, PublishedRace, RanSequence
from rsrl.season import COMPOUNDS, find_car
from rsrl.simulator import Plan
from rsrl.strategists import pit_windows, search_plans

TOP: Final = 10
PARTS: Final = ("start", "compounds", "sequence", "stops")
PLAN, PUBLISHED = "plan", "published"


def published_race(race: ShippedRace, races: int, window_races: int, seed: int) -> PublishedRace:
    """The best plan of the race's default driver beside published ones and the top ten's.

    Args:
        race: with published strategies in its season file.
        races: that the search simulates in all, as `--races` of `rsrl plan`.
        window_races: for each lap of a pit window.
        seed: of the search.
    """
    record = race.record
    car = find_car(record, None)
    best, following = search_plans(record, car, seed=seed, budget=races).by_compounds[:2]
    windows = pit_windows(record, car, [best.plan], seed=seed, races=window_races)[0]
    ran = top_ten(race)
    return PublishedRace(
        race=record.name,
        driver=record.cars[car].driver,
        best=str(best.plan),
        windows=windows,
        p_best=best.p_best,
        next_best=str(following.plan),
        behind_places=following.behind_best,
        published=record.published,
        top_ten=sequences(ran),
        agrees=agreement(best.plan, PLAN, ran) | agreement(Plan.parse(record.published[0]), PUBLISHED, ran),
    )


def top_ten(race: ShippedRace) -> list[CarChoice]:
    """The first ten of the result whose tyres are known, in order of the result."""
    known = (c for c in race.choices.cars if min(c.compounds, default=-1) >= 0 and len(c.stops) == len(c.compounds) - 1)
    places = race.facts.positions
    return sorted((c for c in known if places.get(c.driver, TOP + 1) <= TOP), key=lambda c: places[c.driver])


def sequences(cars: Sequence[CarChoice]) -> tuple[RanSequence, ...]:
    """Sequences that cars ran, most cars first, then the one of the better result."""
    groups: dict[tuple[int, ...], list[CarChoice]] = {}
    for car in cars:
        groups.setdefault(car.compounds, []).append(car)
    return tuple(_ran(compounds, own) for compounds, own in sorted(groups.items(), key=lambda item: -len(item[1])))


def _ran(compounds: tuple[int, ...], cars: Sequence[CarChoice]) -> RanSequence:
    laps = np.median([c.stops for c in cars], axis=0).round().astype(int).tolist()
    slow = sum(not green for c in cars for green in c.green)
    return RanSequence("-".join(COMPOUNDS[c] for c in compounds), len(cars), tuple(laps), slow)


def agreement(plan: Plan, whose: str, ran: Sequence[CarChoice]) -> dict[str, Number]:
    """What a plan has in common with the commonest start, compounds (order left out), sequence and stops of cars, each by itself."""
    if not ran:
        return {f"{whose}_{part}": float("nan") for part in PARTS}
    own = (plan.compounds[0], tuple(sorted(plan.compounds)), plan.compounds, plan.stops)
    plans = [(c.compounds[0], tuple(sorted(c.compounds)), c.compounds, len(c.stops)) for c in ran]
    theirs = [most(part) for part in zip(*plans, strict=True)]
    return {f"{whose}_{part}": float(a == b) for part, a, b in zip(PARTS, own, theirs, strict=True)}
