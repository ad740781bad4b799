"""`plans`: what pit walls chose, beside the best plans of the simulated race and the probabilities of the choice model.

Nothing of the race but its entry, grid, qualifying and nominated tyres is known, as in a forecast. Scored are the cars whose plan was
their own: they finished within two laps of the winner and made all their stops on racing laps. Races with rain or a red flag stand apart.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.calibration.choices import (
    SEQUENCE_INDEX,
    SEQUENCES,
    CarChoice,
    RaceChoices,
    RacePlans,
    grid_group,
    sequence_name,
    setting_before,
)
from rsrl.evaluation.backtest.forecast import Season, forecast_record
from rsrl.evaluation.backtest.plan_ranking import CarPlans, Ranking, rank_plans
from rsrl.evaluation.backtest.plan_scores import CarScores, logloss_lead, overall, summary
from rsrl.evaluation.backtest.run import Progress
from rsrl.results import MeanInterval, PlanBaselines, PlanCar, PlanOverall, PlanRace
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, compile_figures

PREDICTORS: Final = ("simulation", "choice_model", "frequency", "published")


@dataclass(frozen=True)
class PlansBacktest:
    """The whole of it."""

    fit: tuple[int, ...]
    test: int
    simulated_races: int
    seed: int
    overall: PlanOverall
    difference_to_frequency: MeanInterval | None
    baselines: PlanBaselines
    races: tuple[PlanRace, ...]


def run_plans(season: Season, *, races: int = 200, seed: int = 0, progress: Progress | None = None) -> PlansBacktest:
    """Rank the plans of every car of the test season whose plan was its own.

    Args:
        season: of `read_season`.
        races: simulated races for each plan in the final ranking.
        seed: of the simulated races.

    Raises:
        RsrlError: a race that cannot be read.
    """
    scored: dict[str, list[list[CarScores]]] = {name: [] for name in PREDICTORS}
    found = []
    indices = season.test_indices
    for n, index in enumerate(indices):
        if progress:
            progress(season.name(index), n, len(indices))
        race, cars = _one_race(season, index, races, seed)
        found.append(race)
        if race.apart is None:
            for name in PREDICTORS:
                scored[name].append(cars[name])
    if progress:
        progress("ranked", len(indices), len(indices))
    means = {name: overall([r for r in rows if r], seed) for name, rows in scored.items()}
    lead = logloss_lead(scored["simulation"], scored["frequency"], seed)
    baselines = PlanBaselines(**{name: means[name] for name in PREDICTORS[1:]})
    return PlansBacktest(season.fit, season.test, races, seed, means["simulation"], lead, baselines, tuple(found))


def _one_race(season: Season, index: int, races: int, seed: int) -> tuple[PlanRace, dict[str, list[CarScores]]]:
    past = season.book.races[index]
    choices = next(r for r in season.fits.history if r.key.season_round == (past.season, past.round))
    record = forecast_record(season, index)
    rows: dict[str, list[CarScores]] = {name: [] for name in PREDICTORS}
    cars = []
    apart = _apart(choices)
    if apart is None:
        model = season.fits.before(past.season, past.round)
        expected = model.plans(setting_before(choices, model.history))
        own = [c for c in choices.cars if c.own and any(x.driver == c.driver for x in record.cars)]
        rankings = _rank(record, own, races, seed)
        for car, ranking in zip(own, rankings, strict=True):
            for name, row in _scores(car, own, ranking, expected, record).items():
                rows[name].append(row)
            cars.append(_plan_car(car, ranking, expected))
    logloss = summary(rows["frequency"])["choice_logloss"]
    race = PlanRace(
        **summary(rows["simulation"]),
        race=record.name,
        season=past.season,
        round=past.round,
        apart=apart,
        frequency_logloss=logloss,
        cars=tuple(cars),
    )
    return race, rows


def _apart(choices: RaceChoices) -> str | None:
    if choices.wet:
        return "wet"
    if choices.red:
        return "red flag"
    return None if choices.clean and any(c.own for c in choices.cars) else "few cars"


def _rank(record: RaceRecord, cars: list[CarChoice], races: int, seed: int) -> list[Ranking]:
    """Rankings of the cars; stop laps on an empty track are the same for all, since no car figure enters them but the stop."""
    figures = compile_figures(record)
    plans = CarPlans(record, 0)
    return [rank_plans(record, figures, record.car_index(c.driver), plans, Plan(c.compounds, c.stops), seed, races) for c in cars]


def _scores(car: CarChoice, own: list[CarChoice], ranking: Ranking, expected: RacePlans, record: RaceRecord) -> dict[str, CarScores]:
    """Scores of one car by predictor."""
    ran, group = car.sequence, grid_group(car.grid)
    others = [(c.grid, c.sequence) for c in own if c is not car]
    probability = expected.log_probability()[group]
    loss = float(-probability[ran])
    given = float(-expected.log_probability_given(others)[group][ran])
    published = Plan.parse(record.published[0]).compounds if record.published else None
    utility = expected.utility_s[group]
    best = SEQUENCE_INDEX.get(ranking.best.compounds)
    return {
        "simulation": CarScores.of(
            ran,
            best,
            regret_places=ranking.regret_places,
            regret_s=ranking.regret_s,
            first_stop_off_laps=float(ranking.own_sequence_first_stop - car.stops[0]),
            choice_logloss=loss,
            choice_logloss_given_others=given,
        ),
        "choice_model": CarScores.of(
            ran,
            int(probability.argmax()),
            regret_s=float(utility[ran] - np.min(utility[expected.allowed >= 0])),
            first_stop_off_laps=expected.best_first_stop(ran) - car.stops[0],
            choice_logloss=loss,
            choice_logloss_given_others=given,
        ),
        "frequency": CarScores.of(ran, int(expected.log_frequency.argmax()), choice_logloss=float(-expected.log_frequency[ran])),
        "published": CarScores.of(ran, SEQUENCE_INDEX.get(published) if published else None),
    }


def _plan_car(car: CarChoice, ranking: Ranking, expected: RacePlans) -> PlanCar:
    return PlanCar(
        driver=car.driver,
        team=car.team,
        grid=car.grid,
        ran=str(Plan(SEQUENCES[car.sequence], car.stops)),
        best=str(ranking.best),
        regret_places=ranking.regret_places,
        regret_s=ranking.regret_s,
        p_ran=float(np.exp(expected.log_probability()[grid_group(car.grid)][car.sequence])),
    )


def commonest(race: PlanRace, field: str) -> str:
    """The sequence that most cars ran (`ran`) or that is best for most (`best`), such as `M-H (11 of 14)`; a dash without cars."""
    names = [sequence_name(SEQUENCE_INDEX[Plan.parse(getattr(c, field)).compounds]) for c in race.cars]
    if not names:
        return "-"
    most = max(sorted(set(names)), key=names.count)
    return f"{most} ({names.count(most)} of {len(names)})"
