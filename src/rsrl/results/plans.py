"""The result of `rsrl backtest --mode plans`: what teams chose beside the best plans of the simulated race."""

from rsrl.results.backtest import MeanInterval
from rsrl.results.base import Number, Provenance, Result


class PlanMeasures(Result, frozen=True):
    """Scores of a predictor of plans; None where it says nothing. Shares are of cars.

    Attributes:
        start_match, compounds_match, sequence_match, stops_match: its best plan begins on the car's tyre, has its compounds in any order,
            in order, as many stops.
        regret_places, regret_s: medians of what the car's own plan gives away to the best plan, in the simulated race.
        first_stop_error_laps: mean absolute error of the first stop of the best plan of the car's own sequence.
        first_stop_bias_laps: mean of the same, above zero where the plan stops later than the car.
        choice_logloss: mean of minus the log probability of the sequence that was run.
        choice_logloss_given_others: the same once the other cars' sequences are known.
    """

    start_match: Number
    compounds_match: Number
    sequence_match: Number
    stops_match: Number
    regret_places: Number
    regret_s: Number
    first_stop_error_laps: Number
    first_stop_bias_laps: Number
    choice_logloss: Number
    choice_logloss_given_others: Number


class PlanOverall(PlanMeasures, frozen=True):
    """Over all cars of the scored races, with intervals of a bootstrap over races, by measure."""

    races: int
    cars: int
    intervals: dict[str, MeanInterval]


class PlanBaselines(Result, frozen=True):
    """The most probable sequence of the choice model, the most frequent one at the circuit, and the published strategy."""

    choice_model: PlanOverall
    frequency: PlanOverall
    published: PlanOverall


class PlanCar(Result, frozen=True):
    """One car: the plan it ran and the best plan of the simulated race.

    Attributes:
        ran, best: as `S-H@14`.
        regret_places, regret_s: of the plan it ran, against the best plan.
        p_ran: probability of its sequence under the choice model.
    """

    driver: str
    team: str
    grid: int
    ran: str
    best: str
    regret_places: float
    regret_s: float
    p_ran: float


class PlanRace(PlanMeasures, frozen=True):
    """One race; `apart` says why it is not scored: `wet`, `red flag` or `few cars`."""

    race: str
    season: int
    round: int
    apart: str | None
    frequency_logloss: Number
    cars: tuple[PlanCar, ...]


class PlansResult(Result, frozen=True):
    """The whole file."""

    mode: str
    fit: tuple[int, ...]
    test: int
    simulated_races: int
    overall: PlanOverall
    difference_to_frequency: MeanInterval | None
    baselines: PlanBaselines
    races: tuple[PlanRace, ...]
    provenance: Provenance
