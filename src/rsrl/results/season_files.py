"""Results of the scripts in `benchmarks/` that hold the shipped season files against the races they are of."""

from rsrl.results.backtest import MeanInterval
from rsrl.results.base import Interval, Number, Provenance, Result, known


class PassesRace(Result, frozen=True):
    """Passes on track in one race: real ones, and means of simulated races with their standard errors."""

    race: str
    season: int
    real: float
    real_stops: float
    real_stops_se: float
    rivals_decide: float
    rivals_decide_se: float


class PassesRatio(Result, frozen=True):
    """Simulated passes a race, and their ratio to the real ones with its interval over races."""

    passes: float
    ratio: Number
    ci95: Interval


class PassesSeason(Result, frozen=True):
    """The dry races of a season, `all` for those of every season: simulated with the real stops, and with rivals that decide theirs."""

    season: str
    races: int
    real: float
    real_stops: PassesRatio
    rivals_decide: PassesRatio


class PassesResult(Result, frozen=True):
    """Of `benchmarks/passes.py`."""

    simulated_races: int
    seasons: tuple[PassesSeason, ...]
    races: tuple[PassesRace, ...]
    provenance: Provenance


class Domination(Result, frozen=True):
    """Two compounds of a race of which one is quicker when fresh and wears no more than the other.

    Attributes:
        better, worse: compound letters.
        fresh_s, fresh_se: by how much the better one is quicker when fresh.
        wear_s_per_lap, wear_se: by how much it wears less.
        reason: the figures of both and what the season file says they rest on.
    """

    better: str
    worse: str
    fresh_s: float
    fresh_se: float
    wear_s_per_lap: float
    wear_se: float
    reason: str


class OwnPlansCar(Result, frozen=True):
    """One car in its own race: the best plans there.

    Attributes:
        best: of the best mean position; `quickest`: of the least mean race time; `commonest`: the field's sequence on its best stop laps,
            None where the file gives the car too few sets for it.
        regret_places, regret_s: what `commonest` loses to `best`; `behind_quickest_s`: to `quickest`.
    """

    driver: str
    grid: int
    best: str
    quickest: str
    commonest: str | None
    regret_places: Number
    regret_s: Number
    behind_quickest_s: Number


class OwnPlansRace(Result, frozen=True):
    """One race: what most of its field ran, and what its season file thinks best.

    Attributes:
        apart: why only its starting tyre is scored (`few cars`); None for a race that is scored.
        start, starts, started: the compound most cars started on, how many did, of how many.
        ran, ran_cars, own_cars: the sequence most cars ran whose plan was their own, how many did, of how many.
        first_stop: median lap of their first stop.
        clean_air_best: the quickest plan on an empty track.
        scores: measures of the race; null where it has none.
    """

    race: str
    season: int
    apart: str | None
    start: str
    starts: int
    started: int
    ran: str | None
    ran_cars: int
    own_cars: int
    first_stop: Number
    clean_air_best: str
    cars: tuple[OwnPlansCar, ...]
    scores: dict[str, Number]
    dominations: tuple[Domination, ...]


class OwnPlansResult(Result, frozen=True):
    """Of `benchmarks/own_race_plans.py`; `overall` by measure, `goals` as shares, s and laps."""

    simulated_races: int
    overall: dict[str, MeanInterval]
    goals: dict[str, float]
    races: tuple[OwnPlansRace, ...]
    provenance: Provenance


class BetterPlan(Result, frozen=True):
    """The field's commonest sequence of a race against the best other one, both on their best stop laps, for one car.

    Attributes:
        driver, grid: the car in the middle of those that ran the commonest sequence.
        ran, ran_cars, own_cars: that sequence, how many ran it, of how many whose plan was their own.
        commonest, better: the two plans.
        gain_s, gain_places: what the other plan gains, mean over draws of the file's figures; with intervals that hold their errors.
        parts_s: of the gain, by stops, fresh tyres, wear, and traffic and safety cars; they sum to `gain_s`.
        why: the same in words.
    """

    race: str
    season: int
    driver: str
    grid: int
    ran: str
    ran_cars: int
    own_cars: int
    commonest: str
    better: str
    gain_s: float
    gain_s_ci95: Interval
    gain_places: float
    gain_places_ci95: Interval
    parts_s: dict[str, float]
    why: str

    @property
    def clear(self) -> bool:
        """Whether the file says that the other plan would have been better: quicker with an interval clear of zero, and no place behind."""
        both = known(self.gain_s_ci95)
        return both is not None and both[0] > 0 and self.gain_places > 0


class BetterPlansResult(Result, frozen=True):
    """Of `benchmarks/better_plans.py`: every race asked about; `left_out` by reason."""

    simulated_races: int
    draws: int
    races: tuple[BetterPlan, ...]
    left_out: dict[str, str]
    provenance: Provenance


class RanSequence(Result, frozen=True):
    """A sequence that cars of a race's top ten ran: how many, the median lap of each stop, and stops made behind a safety car."""

    sequence: str
    cars: int
    stop_laps: tuple[int, ...]
    slow_stops: int


class PublishedRace(Result, frozen=True):
    """One race: what `rsrl plan` says, what was published before it, and what its top ten ran.

    Attributes:
        driver: whose plan it is, the race's default driver.
        best: his best plan; `windows`: first and last lap of each of its stops; `p_best`: how sure it is to be the best of its sequences.
        next_best, behind_places: the best plan of another sequence, and its distance.
        published: as plans, first choice first.
        top_ten: most cars first.
        agrees: 1 or 0, what `rsrl plan` and the first published strategy have in common with the commonest of the top ten, by
            `plan_` or `published_` and start, compounds, sequence, stops; null where the top ten tells none.
    """

    race: str
    driver: str
    best: str
    windows: tuple[tuple[int, int], ...]
    p_best: float
    next_best: str
    behind_places: float
    published: tuple[str, ...]
    top_ten: tuple[RanSequence, ...]
    agrees: dict[str, Number]


class PublishedResult(Result, frozen=True):
    """Of `benchmarks/published_plans.py`; `overall` is the mean of `agrees` over races."""

    simulated_races: int
    overall: dict[str, MeanInterval]
    races: tuple[PublishedRace, ...]
    provenance: Provenance


class LateLapsRace(Result, frozen=True):
    """Errors of one race's laps late in their stints and before, s: with the tyres of laps and choices, and of lap times alone."""

    race: str
    late_laps: int
    late_s: float
    late_lap_times_s: float
    early_laps: int
    early_s: float
    early_lap_times_s: float


class LateLapsResult(Result, frozen=True):
    """Of `benchmarks/late_laps.py`; `overall` has root mean squares over all laps of the races, and `_less` what choices change in them."""

    fit: tuple[int, ...]
    test: int
    late_share: float
    overall: dict[str, MeanInterval]
    goals: dict[str, float]
    races: tuple[LateLapsRace, ...]
    provenance: Provenance
