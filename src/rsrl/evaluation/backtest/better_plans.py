"""Where a season file says that another sequence would have been better than the one most of its field ran, how sure it is, and why.

Both plans are chosen by the file's figures: the commonest sequence on its best stop laps, and the best of all others. They are then driven
in the same simulated races, by the file's figures for what one gains on the other, and under figures drawn within their errors
(`rsrl.season.perturbed`) for how sure that is: a gain clear of zero does not hang on one figure's error. Plans are not changed for a draw:
a pit wall chooses by the figures it has. Errors are drawn as the season file has them, those of tyres each on its own.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from rsrl.calibration.choices import SEQUENCE_INDEX, sequence_name
from rsrl.evaluation.backtest.field_choice import field_choice
from rsrl.evaluation.backtest.plan_ranking import CarPlans, plan_means, rank_sequences
from rsrl.evaluation.backtest.shipped_races import ShippedRace
from rsrl.results import BetterPlan
from rsrl.season import COMPOUND_NAMES, COMPOUNDS, RaceRecord, perturbed
from rsrl.simulator import Figures, Plan, compile_figures
from rsrl.state import expected_stop_s
from rsrl.statistics import normal_interval
from rsrl.strategists import CleanAir

DRAWS: Final = 100
OTHER_RACES: Final = 1_000_000
"""Number of the first race that the two plans are compared on: none that they were chosen on."""

DRAW_SHARE: Final = 4
"""A draw of the figures has a quarter of the races."""

TOLD_S: Final = 0.5
"""Parts of a gain below this are not told in words."""

STOPS, FRESH, WEAR, TRAFFIC = "stops", "fresh tyres", "wear", "traffic and safety cars"


def better_plan(race: ShippedRace, races: int, seed: int, draws: int = DRAWS) -> BetterPlan | str:
    """The best other sequence of a race against the commonest one.

    Args:
        race: dry, without a red flag.
        races: simulated for each plan, to choose by (see `rank_sequences`) and to compare on.
        seed: of the simulated races and of the draws.
        draws: of the figures.

    Returns:
        The comparison; or why there is none.
    """
    record, field = race.record, field_choice(race.choices)
    if field.few or field.sequence is None:
        return "few cars ran a plan of their own"
    cars = field.on_sequence
    choice = cars[(len(cars) - 1) // 2]
    car = record.car_index(choice.driver)
    plans = CarPlans(record, car)
    figures = compile_figures(record)
    ranked = [r.plan for r in rank_sequences(figures, car, plans.candidates(field.sequence), seed, races)]
    commonest = next((p for p in ranked if p.compounds == field.sequence), None)
    name = sequence_name(SEQUENCE_INDEX[field.sequence])
    if commonest is None:
        return f"the file gives {choice.driver} too few sets for {name}"
    other = next(p for p in ranked if p.compounds != field.sequence)
    gain_s, places = gain(figures, car, other, commonest, seed, races)
    drawn = np.array(list(drawn_gains(record, car, other, commonest, max(races // DRAW_SHARE, 1), seed, draws)))
    errors = drawn.std(axis=0, ddof=1).tolist()
    parts = parts_s(record, car, other, commonest, gain_s)
    return BetterPlan(
        race=record.name,
        season=record.season,
        driver=choice.driver,
        grid=choice.grid,
        ran=name,
        ran_cars=len(cars),
        own_cars=len(field.own),
        commonest=str(commonest),
        better=str(other),
        gain_s=gain_s,
        gain_s_ci95=normal_interval(gain_s, errors[0]),
        gain_places=places,
        gain_places_ci95=normal_interval(places, errors[1]),
        parts_s=parts,
        why=why(record, car, other, commonest, parts),
    )


def gain(figures: Figures, car: int, plan: Plan, base: Plan, seed: int, races: int) -> tuple[float, float]:
    """What a plan gains on another in the same races: s and places."""
    place, time_s = plan_means(figures, car, [plan, base], seed, OTHER_RACES + np.arange(races, dtype=np.int64))
    return float(time_s[1] - time_s[0]), float(place[1] - place[0])


def drawn_gains(record: RaceRecord, car: int, plan: Plan, base: Plan, races: int, seed: int, draws: int) -> Iterator[tuple[float, float]]:
    """`gain` under each draw of the figures, in the same races.

    The spread over draws is the error of the gain; the luck of a draw's few races adds to it, so it is rather too wide.
    """
    for draw in range(draws):
        figures = compile_figures(perturbed(record, np.random.default_rng((seed, draw))))
        yield gain(figures, car, plan, base, seed, races)


def parts_s(record: RaceRecord, car: int, plan: Plan, base: Plan, gain_s: float) -> dict[str, float]:
    """What a plan gains on another by part, s: on an empty track by stops, fresh tyres and wear; what the race adds is traffic's."""
    clean_air, stop_s = CleanAir(record, car), expected_stop_s(compile_figures(record), car)
    stops, fresh = (_stops_s(record, base, stop_s) - _stops_s(record, plan, stop_s), _fresh_s(record, base) - _fresh_s(record, plan))
    empty = clean_air.time_s(base) - clean_air.time_s(plan)
    return {STOPS: stops, FRESH: fresh, WEAR: empty - stops - fresh, TRAFFIC: gain_s - empty}


def _stops_s(record: RaceRecord, plan: Plan, stop_s: float) -> float:
    """What a plan's stops cost, first laps on cold tyres among it."""
    return sum(stop_s + record.tyres[COMPOUNDS[c]].cold_loss_s.value for c in plan.compounds[1:])


def _fresh_s(record: RaceRecord, plan: Plan) -> float:
    """What a plan's laps cost by compound, all on fresh tyres."""
    lengths = np.diff((0, *plan.laps, record.laps)).tolist()
    return float(sum(n * record.tyres[COMPOUNDS[c]].offset_s.value for c, n in zip(plan.compounds, lengths, strict=True)))


def why(record: RaceRecord, car: int, plan: Plan, base: Plan, parts: dict[str, float]) -> str:
    """A sentence of what wins and what loses, largest first, with the figures that make it."""
    told = sorted((part for part, s in parts.items() if abs(s) >= TOLD_S), key=lambda part: -abs(parts[part]))
    won, lost = ([_words(record, car, plan, base, p, parts[p]) for p in told if (parts[p] > 0) == sign] for sign in (True, False))
    if not won:
        return f"{_joined(lost)}, and nothing to make up for it" if lost else "nothing between them"
    return f"{_joined(won)}" + (f", against {_joined(lost)}" if lost else "")


def _joined(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _words(record: RaceRecord, car: int, plan: Plan, base: Plan, part: str, gain_s: float) -> str:
    used = [COMPOUNDS[c] for c in sorted({*plan.compounds, *base.compounds})]
    amount = f"{abs(gain_s):.1f} s"
    if part == STOPS:
        more = plan.stops - base.stops
        if not more:
            return f"{'quicker' if gain_s > 0 else 'slower'} first laps on cold tyres ({amount})"
        stop_s = expected_stop_s(compile_figures(record), car)
        return f"{abs(more)} stop{'s' * (abs(more) > 1)} {'fewer' if more < 0 else 'more'} ({amount}: a stop costs {stop_s:.1f} s)"
    if part == FRESH:
        offsets = ", ".join(f"{c} {record.tyres[c].offset_s.value:+.2f}" for c in used)
        return f"{'quicker' if gain_s > 0 else 'slower'} compounds ({amount}: fresh {offsets} s)"
    if part == WEAR:
        wears = ", ".join(f"{COMPOUND_NAMES[COMPOUNDS.index(c)]} {record.tyres[c].wear_s_per_lap.value:.3f}" for c in used)
        return f"{'less' if gain_s > 0 else 'more'} wear ({amount}: {wears} s a lap)"
    threshold = record.track.pass_threshold_s.value
    return f"{'less' if gain_s > 0 else 'more'} lost in traffic and safety cars ({amount}: a pass asks for {threshold:.1f} s a lap)"
