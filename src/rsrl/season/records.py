"""Typed, frozen records of fitted figures for one Grand Prix.

Every fitted number is a `Figure`: estimate, standard error and sample size. Records hold no physics: calibration writes
them, the simulator reads them, and `toml_io` stores them in TOML files.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from rsrl.season.tyre_sets import TyreSets
from rsrl.season.vocabulary import COMPOUNDS, FEWEST_SETS, FOLLOWING_AIDS


class Figure(NamedTuple):
    """One fitted number: `value` with standard error `se`, from `n` observations.

    `n` is 0 and `se` the assumed uncertainty where the value is taken from literature or a rule;
    `note` then names the source.
    """

    value: float
    se: float
    n: int
    note: str = ""


@dataclass(frozen=True)
class TrackFigures:
    """Circuit and field-wide figures; all times in seconds."""

    base_lap_s: Figure  # lap of the average car (pace_s = 0) in free air, fresh medium, empty tank
    fuel_s_per_kg: Figure  # lap time per kg of fuel on board
    fuel_start_kg: Figure  # fuel at the start; burned evenly to zero at the flag
    lap_noise_sd_s: Figure  # independent lap-to-lap noise
    stint_sd_s: Figure  # spread of a stint's pace about the car's (set of tyres, how it was managed); drawn anew at every stop
    evolution_s: Figure  # how much quicker the track gets from the start to the flag, fuel burned apart; below zero: slower
    start_loss_s: Figure  # lap 1 against a flying lap, for the standing start
    start_per_place_s: Figure  # lap 1, further loss per grid place behind pole
    start_sd_s: Figure  # lap 1, spread between cars
    drs_gain_s: Figure  # per lap, within drs_window_s of the car ahead
    drs_window_s: Figure
    dirty_air_loss_s: Figure  # at zero gap, fading linearly to nothing at dirty_air_window_s
    dirty_air_window_s: Figure
    following_gap_s: Figure  # gap at the line of a car held up by the one ahead
    pass_threshold_s: Figure  # pace advantage per lap at which half the attempts succeed
    pass_scale_s: Figure  # logistic scale of that advantage
    pass_loss_s: Figure  # lost by the passing car in the duel
    passed_loss_s: Figure  # lost by the passed car
    blue_flag_loss_s: Figure  # lost by a lapped car, each time it is lapped
    lapping_loss_s: Figure  # lost by the lapping car, each time it laps one
    pass_per_gap: Figure | None = None  # rise of the threshold per s of gap beyond following_gap_s as the lap starts; None: older rule
    launch_loss_s: dict[str, Figure] | None = None  # by compound: lap 1 from the grid against the medium's, grip at the start; None: alike


@dataclass(frozen=True)
class TyreFigures:
    """One compound at this track: lap time added = offset + wear x age + curvature x age squared (+ cold lap)."""

    c_number: str  # Pirelli C0..C6
    offset_s: Figure  # fresh tyre against the fresh medium
    wear_s_per_lap: Figure
    curvature_s_per_lap2: Figure
    cold_loss_s: Figure  # first lap out of the pits
    sets: int  # sets of this compound a car has for the race, the one it starts on included; a car may have others (`CarFigures.sets`)


@dataclass(frozen=True)
class PitFigures:
    """Time lost by a stop against staying out on the same lap, by the quickest stop; slower ones by a distribution on top."""

    loss_green_s: Figure
    loss_vsc_s: Figure
    loss_sc_s: Figure
    in_lap_share: Figure  # share of the loss that falls on the in-lap; the rest is in the out-lap's time
    stack_s: Figure  # from a car's arrival until the team can serve its next car; the first stop's excess over the quickest is added
    tail_scale_s: Figure  # stop time beyond the quickest is log-logistic: scale x (u / (1 - u)) ** (1 / shape)
    tail_shape: Figure
    tail_max_s: Figure


@dataclass(frozen=True)
class IncidentFigures:
    """Safety cars. Durations are probabilities of 1, 2, 3 ... laps and sum to one.

    `sc_lap1`, `sc_per_lap` and `vsc_per_lap` are totals: those that come with a retirement are among them.
    """

    sc_lap1: Figure  # probability of a safety car on lap 1
    sc_per_lap: Figure  # hazard on each later racing lap
    vsc_per_lap: Figure
    red_share: Figure  # of safety cars that become a red flag: free change of tyres, restart from a standing grid
    sc_laps: tuple[float, ...]
    vsc_laps: tuple[float, ...]
    sc_lap_factor: Figure  # leader's lap behind the safety car / base lap
    sc_catch_factor: Figure  # lap of a car closing up to the queue / base lap
    vsc_lap_factor: Figure
    sc_gap_s: Figure  # gap between queuing cars
    sc_wear_factor: Figure  # tyre ageing on such a lap against a racing lap
    vsc_wear_factor: Figure
    sc_per_retirement: Figure | None = None  # probability that a car that retires after lap 1 brings out a safety car; None: unrelated
    vsc_per_retirement: Figure | None = None  # the same of a virtual one
    sc_per_retirement_lap1: Figure | None = None  # probability that a car out on lap 1 brings out a safety car


@dataclass(frozen=True)
class CarFigures:
    """One car and driver of the field that started."""

    driver: str
    team: str
    grid: int  # 1 is pole; pit-lane starters stand at the back
    pace_s: Figure  # lap time against the average car's; below zero is quicker
    form_sd_s: Figure  # spread of that pace from race to race
    noise_factor: Figure  # lap noise against the field's
    start_gain_s: Figure  # lap 1 against the expectation for the grid place; below zero is quicker
    retire_per_lap: Figure  # hazard on each lap after the first
    retire_lap1: Figure  # probability of not completing lap 1
    stop_loss_s: Figure  # the team's stops against the average stop
    stop_tail_factor: Figure  # the team's excess over the quickest stop against the field's
    sets: TyreSets | None = None  # its own sets where they are not the race's: laps that each has run before the race
    team_form_share: Figure | None = None  # share of the variance of form that team mates have in common; None: none


@dataclass(frozen=True)
class RivalPlan:
    """A strategy some team ran, as `S-H@14-S@36`, and how many cars ran it."""

    plan: str
    weight: float


@dataclass(frozen=True)
class RivalFigures:
    """How the other cars decide their stops.

    Plans alone: a plan drawn from those that teams ran, shifted a little, with a safety-car reaction. Reactive (`hazard` and `choice`
    given): the plan gives the starting tyre; each lap the coefficients give the log-odds of boxing and the compound.
    """

    plans: tuple[RivalPlan, ...]
    jitter_sd_laps: Figure  # spread of a stop's lap around the plan's
    sc_window_laps: Figure  # under a safety car, a planned stop at most this far ahead is taken now
    sc_reaction: Figure  # probability of doing so
    vsc_window_laps: Figure
    vsc_reaction: Figure
    life_laps: dict[str, Figure] = field(default_factory=dict)  # usual stint by compound letter
    hazard: dict[str, Figure] = field(default_factory=dict)  # log-odds of boxing at the end of a lap, by feature
    choice: dict[str, Figure] = field(default_factory=dict)  # utility of a compound at a stop, by feature


@dataclass(frozen=True)
class Provenance:
    """Where the figures come from, so that anyone can reproduce them."""

    command: str
    date: str
    version: str
    data: tuple[str, ...]  # names and SHA-256 (first 12 digits) of the lap files
    laps_used: int
    laps_read: int


@dataclass(frozen=True)
class RaceRecord:
    """Everything the simulator needs to know about one Grand Prix."""

    name: str  # `bahrain-2023`
    season: int
    round: int
    event: str  # as in the lap files
    grand_prix: str  # `bahrain`
    laps: int
    wet: bool  # any car ran intermediates or wets
    default_driver: str
    max_laps_per_set: int  # 0: no such rule
    min_sets: int = field(default=FEWEST_SETS, kw_only=True)  # sets that a car must use, at Monaco in 2025 three
    following_aid: str = field(default=FOLLOWING_AIDS[0], kw_only=True)  # what a car within drs_window_s of the next may use
    drs_off_laps: int  # laps without that aid after the start, and after a safety car or a red flag; a virtual one gives it back at once
    track: TrackFigures
    tyres: dict[str, TyreFigures]
    pit: PitFigures
    incidents: IncidentFigures
    cars: tuple[CarFigures, ...]  # in grid order
    rivals: RivalFigures
    published: tuple[str, ...]  # strategies published before the race
    provenance: Provenance
    scaling: dict[str, tuple[float, float]] = field(default_factory=dict)  # working range of each feature, fitted on simulated races

    def car_index(self, driver: str) -> int:
        """Index of a driver's car in `cars`; raises KeyError for a driver who did not start."""
        for i, car in enumerate(self.cars):
            if car.driver == driver:
                return i
        raise KeyError(driver)

    @property
    def stops_asked(self) -> int:
        """Stops that `min_sets` asks for; 0 where it asks for no more than two compounds do."""
        return self.min_sets - 1 if self.min_sets > FEWEST_SETS else 0

    @property
    def sets(self) -> tuple[int, int, int]:
        """Sets of soft, medium and hard of a car that has none of its own (`sets_of`); all are new."""
        s, m, h = (self.tyres[c].sets for c in COMPOUNDS)
        return s, m, h

    def sets_of(self, car: int | None) -> tuple[tuple[int, ...], ...]:
        """Sets of a car for the race by compound code: the laps that each has run before it, the freshest first, as it is fitted first.

        `car` None: of a car that has no sets of its own.
        """
        own = None if car is None else self.cars[car].sets
        return tuple((0,) * n for n in self.sets) if own is None else tuple(tuple(sorted(own[c])) for c in COMPOUNDS)
