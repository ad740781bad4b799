"""The best plans of a race by its own season file, beside what most of its field ran.

The file may know the race, so nothing is forecast: this asks whether a simulated race is one in which its pit walls would have decided
as they did. Plans are ranked in the race, with rivals, traffic and luck, for three cars of those that ran the commonest sequence, at the
quarters of their grid places: the best plan of a front car need not be that of one in traffic. On an empty track plans are ranked exactly.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from rsrl.calibration.choices import SEQUENCE_INDEX, CarChoice, sequence_name
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.field_choice import FieldChoice, field_choice
from rsrl.evaluation.backtest.plan_ranking import CarPlans, fresh_means, rank_sequences
from rsrl.evaluation.backtest.shipped_races import ShippedRace
from rsrl.evaluation.backtest.tyre_order import dominations
from rsrl.results import OwnPlansCar, OwnPlansRace
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import Figures, Plan, compile_figures

MATCHES: Final = ("start_match", "compounds_match", "sequence_match", "stops_match")
CLEAN_AIR: Final = "clean_air_"
MEASURES: Final = (
    *MATCHES, "regret_places", "regret_s", "behind_quickest_s", "first_stop_bias_laps", "first_stop_error_laps",
    *(CLEAN_AIR + name for name in (*MATCHES, "regret_s")), "dominated", "dominated_by_softer", "dominated_by_harder",
)  # fmt: skip
"""Of one race: means over its cars; `dominated`: 1 where one compound dominates another, be it the softer or the harder one."""

OF_EVERY_RACE: Final = ("start_match", CLEAN_AIR + "start_match", "dominated", "dominated_by_softer", "dominated_by_harder")
"""Measures that ask for no plan of a car's own: the starting tyre is chosen before anything has happened."""

MEDIANS: Final = ("regret_places", "regret_s", "behind_quickest_s", CLEAN_AIR + "regret_s")
"""Measures of which the median over races counts; of the others it is the mean."""

GOALS: Final = {"start_match": 0.85, "compounds_match": 0.7, "regret_s": 0.7, "dominated": 0.05}
"""At least so large a share of matches; at most so much regret and so large a share of dominated compounds."""

NAN: Final = float("nan")


def own_race(race: ShippedRace, races: int, seed: int) -> OwnPlansRace:
    """The best plans of a race, for three cars, beside the field's commonest choice.

    Args:
        race: dry, without a red flag.
        races: simulated for each plan in each of three rounds: stop laps (a quarter of them), best sequence, regret.
        seed: of the simulated races.

    Raises:
        RsrlError: no car of the season file finished the race.
    """
    record, field = race.record, field_choice(race.choices)
    figures = compile_figures(record)
    found, scores = [], []
    clean_air_best, clean_air_scores = "", dict[str, float]()
    chosen = [c for c in field.three_cars() if any(x.driver == c.driver for x in record.cars)]
    if not chosen:
        raise RsrlError(f"{record.name}: no car of its season file finished the race; calibrate it from this race's laps")
    for choice in chosen:
        plans = CarPlans(record, record.car_index(choice.driver))
        car, of_car = _car(record, figures, choice, field, plans, seed, races)
        found.append(car)
        scores.append(of_car)
        clean_air_best, clean_air_scores = _clean_air(plans, field)
    means = {name: _mean([s[name] for s in scores]) for name in scores[0]} | clean_air_scores
    pairs = tuple(dominations(record))
    softer = [COMPOUNDS.index(p.better) < COMPOUNDS.index(p.worse) for p in pairs]
    means |= {"dominated": float(bool(pairs)), "dominated_by_softer": float(any(softer)), "dominated_by_harder": float(not all(softer))}
    return OwnPlansRace(
        race=record.name,
        season=record.season,
        apart="few cars" if field.few else None,
        start=COMPOUNDS[field.start],
        starts=field.starts[0],
        started=field.starts[1],
        ran=None if field.sequence is None else sequence_name(SEQUENCE_INDEX[field.sequence]),
        ran_cars=len(field.on_sequence),
        own_cars=len(field.own),
        first_stop=field.first_stop,
        clean_air_best=clean_air_best,
        cars=tuple(found),
        scores={name: NAN if field.few and name not in OF_EVERY_RACE else means[name] for name in MEASURES},
        dominations=pairs,
    )


def _car(
    record: RaceRecord, figures: Figures, choice: CarChoice, field: FieldChoice, plans: CarPlans, seed: int, races: int
) -> tuple[OwnPlansCar, dict[str, float]]:
    """The best plans of one car, and its scores."""
    car = record.car_index(choice.driver)
    ranked = rank_sequences(figures, car, plans.candidates(field.sequence or ()), seed, races)
    best, quickest = ranked[0].plan, min(ranked, key=lambda r: r.time_s).plan
    commonest = next((r.plan for r in ranked if r.plan.compounds == field.sequence), None)
    lost = np.full(3, NAN)
    if commonest is not None:
        place, time_s = fresh_means(figures, car, [commonest, best, quickest], seed, races)
        lost = np.array([place[0] - place[1], time_s[0] - time_s[1], time_s[0] - time_s[2]])
    regret = dict(zip(("regret_places", "regret_s", "behind_quickest_s"), lost.tolist(), strict=True))
    off = NAN if commonest is None else commonest.laps[0] - field.first_stop
    scores = _matches(best.compounds, field) | regret | {"first_stop_bias_laps": off, "first_stop_error_laps": abs(off)}
    ran = None if commonest is None else str(commonest)
    return OwnPlansCar(choice.driver, choice.grid, str(best), str(quickest), ran, **regret), scores


def _clean_air(plans: CarPlans, field: FieldChoice) -> tuple[str, dict[str, float]]:
    """The quickest plan on an empty track, and its scores."""
    compounds, (best_s, laps) = min(plans.by_sequence.items(), key=lambda item: item[1][0])
    lost = plans.by_sequence[field.sequence][0] - best_s if field.sequence in plans.by_sequence else NAN
    scores = _matches(compounds, field) | {"regret_s": lost}
    return str(Plan(compounds, laps)), {CLEAN_AIR + name: value for name, value in scores.items()}


def _matches(compounds: tuple[int, ...], field: FieldChoice) -> dict[str, float]:
    """Whether a plan agrees with the field's commonest start, compounds, sequence and stops; NaN where no plan was anyone's own."""
    found = {
        "start_match": float(compounds[0] == field.start),
        "compounds_match": float(tuple(sorted(compounds)) == field.compounds),
        "sequence_match": float(compounds == field.sequence),
        "stops_match": float(len(compounds) - 1 == field.stops),
    }
    return found if field.own else found | dict.fromkeys(MATCHES[1:], NAN)


def _mean(values: Sequence[float]) -> float:
    """Mean of what is known, NaN where nothing is."""
    known = [v for v in values if np.isfinite(v)]
    return float(np.mean(known)) if known else NAN
