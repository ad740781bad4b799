"""The feature registry: every observation is declared once, with unit, kind, range and the group it is explained in.

A *raw row* holds all features of one decision in natural units, float32 [RAW_SIZE], in the order below. A *feature
set* names those a policy reads; the encoder (encoding.py) turns a raw row into its scaled network input.
"""

from dataclasses import dataclass, replace
from typing import Final, Literal

from rsrl.errors import RsrlError
from rsrl.season import COMPOUND_NAMES, GRAND_PRIX, TRACK_STATUS_NAMES

Kind = Literal["continuous", "boolean", "category"]


@dataclass(frozen=True)
class Feature:
    """One observation of the race."""

    name: str
    unit: str
    kind: Kind
    text: str
    group: str
    low: float = 0.0  # range the scaled values run over: 0 or -1 to 1
    fixed: tuple[float, float] | None = None  # natural range; None where it is fitted on simulated races
    categories: tuple[str, ...] = ()
    logarithmic: bool = False  # scaled by the logarithm of 1 + value: a gap's first seconds matter most

    @property
    def width(self) -> int:
        """Columns in the network input."""
        return len(self.categories) if self.kind == "category" else 1


def _number(name: str, unit: str, group: str, text: str, low: float = 0.0, fixed: tuple[float, float] | None = None) -> Feature:
    return Feature(name, unit, "continuous", text, group, low, fixed)


def _flag(name: str, group: str, text: str) -> Feature:
    return Feature(name, "", "boolean", text, group, 0.0, (0.0, 1.0))


def _choice(name: str, group: str, text: str, categories: tuple[str, ...]) -> Feature:
    return Feature(name, "", "category", text, group, categories=categories)


PAPER: Final = (  # Table 1 of the paper, inputs only, in its order
    _choice("track", "track", "Grand Prix", GRAND_PRIX),
    _choice("safety_car", "safety car", "safety car status of the coming lap", TRACK_STATUS_NAMES[:3]),
    _number("position", "place", "position", "position of the car", fixed=(1.0, 20.0)),
    _number("race_progress", "share", "laps", "share of the race completed", fixed=(0.0, 1.0)),
    _choice("tyre", "tyre", "compound fitted", COMPOUND_NAMES),
    _number("tyre_degradation_s", "s", "tyre", "lap time lost to wear of the set fitted"),
    _flag("soft_available", "sets", "a set of softs is left"),
    _flag("medium_available", "sets", "a set of mediums is left"),
    _flag("hard_available", "sets", "a set of hards is left"),
    _number("gap_ahead_s", "s", "gap ahead", "gap to the car one place ahead", low=-1.0),
    _number("gap_behind_s", "s", "gap behind", "gap to the car one place behind", low=-1.0),
    _number("gap_to_leader_s", "s", "gap to leader", "gap to the leader", low=-1.0),
    _number("last_lap_ratio", "ratio", "last lap", "last lap time over the reference lap time", fixed=(0.0, 2.0)),
    _flag("valid_finish", "rules", "two compounds have been used"),
)

EXTRA: Final = (  # what a strategist sees besides
    _number("laps_left", "laps", "laps", "laps to go", fixed=(0.0, 80.0)),
    _number("tyre_age_laps", "laps", "tyre", "laps on the set fitted", fixed=(0.0, 40.0)),
    _number("stops_made", "stops", "stops", "stops made so far", fixed=(0.0, 4.0)),
    _number("soft_sets", "sets", "sets", "sets of softs left", fixed=(0.0, 4.0)),
    _number("medium_sets", "sets", "sets", "sets of mediums left", fixed=(0.0, 4.0)),
    _number("hard_sets", "sets", "sets", "sets of hards left", fixed=(0.0, 4.0)),
    _number("safety_car_laps", "laps", "safety car", "laps since the safety car or virtual safety car came out", fixed=(0.0, 8.0)),
    _number("pit_cost_s", "s", "cost of a stop", "time a stop would cost on this lap"),
    _number("pit_cost_places", "places", "cost of a stop", "places a stop would cost on this lap", fixed=(0.0, 19.0)),
    _number("rejoin_gap_ahead_s", "s", "cost of a stop", "gap to the car ahead after a stop now"),
    _number("rejoin_gap_behind_s", "s", "cost of a stop", "gap to the car behind after a stop now"),
    _number("gap_two_ahead_s", "s", "gap ahead", "gap to the car two places ahead", low=-1.0),
    _number("gap_two_behind_s", "s", "gap behind", "gap to the car two places behind", low=-1.0),
    _number("closing_ahead_s", "s", "gap ahead", "how much the gap ahead shrank on the last lap", low=-1.0),
    _number("tyre_age_ahead_laps", "laps", "car ahead", "tyre age of the car ahead", fixed=(0.0, 40.0)),
    _number("tyre_age_behind_laps", "laps", "car behind", "tyre age of the car behind", fixed=(0.0, 40.0)),
    _choice("tyre_ahead", "car ahead", "compound of the car ahead", COMPOUND_NAMES),
    _choice("tyre_behind", "car behind", "compound of the car behind", COMPOUND_NAMES),
    _number("stops_ahead", "stops", "car ahead", "stops of the car ahead less own stops", low=-1.0, fixed=(-3.0, 3.0)),
    _number("stops_behind", "stops", "car behind", "stops of the car behind less own stops", low=-1.0, fixed=(-3.0, 3.0)),
    _flag("boxed_ahead", "car ahead", "a car still ahead boxed at the end of the last lap"),
    _flag("boxed_behind", "car behind", "a car that boxed at the end of the last lap is behind, within the cost of a stop"),
    _number("cars_in_pit_window", "cars", "cost of a stop", "cars ahead within the time a stop costs", fixed=(0.0, 19.0)),
    _number("stops_to_come_ahead", "stops", "position", "mean stops of the cars ahead less own stops", low=-1.0, fixed=(-3.0, 3.0)),
    _number("cars_running", "cars", "position", "cars still running", fixed=(2.0, 20.0)),
    _number(
        "outlook_stay_s",
        "s",
        "clean-air outlook",
        "staying out: time lost to the flag against the best call, on an empty track",
        fixed=(0.0, 10.0),
    ),
    _number("outlook_soft_s", "s", "clean-air outlook", "boxing for soft: the same", fixed=(0.0, 10.0)),
    _number("outlook_medium_s", "s", "clean-air outlook", "boxing for medium: the same", fixed=(0.0, 10.0)),
    _number("outlook_hard_s", "s", "clean-air outlook", "boxing for hard: the same", fixed=(0.0, 10.0)),
)

FIELD: Final = (  # how quick the cars are by the figures and by the laps they have shown, and on which tyres they are now
    _number("form_s", "s", "own pace", "own form of the day against the figures, by the laps shown", low=-1.0, fixed=(-0.6, 0.6)),
    _number("set_luck_s", "s", "own pace", "own pace on this set beyond form and compound, by the laps shown", low=-1.0, fixed=(-1.0, 1.0)),
    _number("pace_ahead_s", "s", "car ahead", "pace of the car ahead against own, tyres left out", low=-1.0, fixed=(-1.5, 1.5)),
    _number("pace_behind_s", "s", "car behind", "pace of the car behind against own, tyres left out", low=-1.0, fixed=(-1.5, 1.5)),
    _number("tyre_loss_ahead_s", "s", "car ahead", "tyre time a lap of the car ahead against own", low=-1.0, fixed=(-3.0, 3.0)),
    _number("tyre_loss_behind_s", "s", "car behind", "tyre time a lap of the car behind against own", low=-1.0, fixed=(-3.0, 3.0)),
    _number("cars_close_ahead", "cars", "gap ahead", "cars within 5 s ahead", fixed=(0.0, 5.0)),
    _number("cars_close_behind", "cars", "gap behind", "cars within 5 s behind", fixed=(0.0, 5.0)),
    _number("expected_stay_s", "s", "expected time", "staying out: expected loss to the flag, safety cars allowed for", fixed=(0.0, 10.0)),
    _number("expected_soft_s", "s", "expected time", "boxing for soft: the same", fixed=(0.0, 10.0)),
    _number("expected_medium_s", "s", "expected time", "boxing for medium: the same", fixed=(0.0, 10.0)),
    _number("expected_hard_s", "s", "expected time", "boxing for hard: the same", fixed=(0.0, 10.0)),
    _number("projected_place", "place", "projection", "place at the flag, all on an empty track with the best stops", fixed=(1.0, 20.0)),
    _number("projected_soft_places", "places", "projection", "projected places that boxing for soft costs", low=-1.0, fixed=(-2.0, 2.0)),
    _number("projected_medium_places", "places", "projection", "boxing for medium: the same", low=-1.0, fixed=(-2.0, 2.0)),
    _number("projected_hard_places", "places", "projection", "boxing for hard: the same", low=-1.0, fixed=(-2.0, 2.0)),
    _number("cars_at_rejoin", "cars", "cost of a stop", "cars within 4 s ahead of where a stop now would rejoin", fixed=(0.0, 5.0)),
)

FIGURES: Final = (  # what track, season and car are like; the same on every lap of a race
    _number("race_laps", "laps", "track", "laps of the race", fixed=(40.0, 80.0)),
    _number("pit_loss_s", "s", "track", "mean loss of a stop on a racing lap", fixed=(15.0, 35.0)),
    _number("pit_loss_vsc_s", "s", "track", "mean loss of a stop under a virtual safety car", fixed=(8.0, 25.0)),
    _number("pit_loss_sc_s", "s", "track", "mean loss of a stop under a safety car", fixed=(5.0, 22.0)),
    _number("wear_soft_s", "s/lap", "track", "wear of the soft", fixed=(0.0, 0.25)),
    _number("wear_medium_s", "s/lap", "track", "wear of the medium", fixed=(0.0, 0.25)),
    _number("wear_hard_s", "s/lap", "track", "wear of the hard", fixed=(0.0, 0.25)),
    _number("offset_soft_s", "s", "track", "fresh soft against fresh medium", low=-1.0, fixed=(-1.5, 1.5)),
    _number("offset_hard_s", "s", "track", "fresh hard against fresh medium", low=-1.0, fixed=(-1.5, 1.5)),
    _number("pass_threshold_s", "s", "track", "pace advantage at which half the attempts to pass succeed", fixed=(0.0, 3.0)),
    _number("sc_chance", "share", "track", "chance of a safety car on a racing lap", fixed=(0.0, 0.04)),
    _number("vsc_chance", "share", "track", "chance of a virtual safety car on a racing lap", fixed=(0.0, 0.04)),
    _number("set_limit_laps", "laps", "track", "laps a set may run, 0 for no limit", fixed=(0.0, 40.0)),
    _number("rival_stops", "stops", "track", "mean stops of the plans that teams bring", fixed=(0.0, 4.0)),
    _number("grid", "place", "car", "place on the grid", fixed=(1.0, 20.0)),
    _number("pace_s", "s", "car", "lap time of the car against the field's mean", low=-1.0, fixed=(-2.0, 2.0)),
    _number("pace_place", "place", "car", "place of the car by pace", fixed=(1.0, 20.0)),
    _number("field_spread_s", "s", "track", "standard deviation of the cars' pace", fixed=(0.0, 1.5)),
)

FEATURES: Final = PAPER + EXTRA + FIELD + FIGURES
RAW_SIZE: Final = len(FEATURES)
COLUMN: Final = {feature.name: i for i, feature in enumerate(FEATURES)}
"""Column of a feature in a raw row."""

WIDE: Final[dict[str, tuple[float, float]]] = {
    "tyre_degradation_s": (0.0, 5.0),
    "gap_ahead_s": (0.0, 60.0),
    "gap_behind_s": (0.0, 60.0),
    "gap_to_leader_s": (0.0, 120.0),
    "pit_cost_s": (0.0, 35.0),
    "rejoin_gap_ahead_s": (0.0, 60.0),
    "rejoin_gap_behind_s": (0.0, 60.0),
    "gap_two_ahead_s": (0.0, 60.0),
    "gap_two_behind_s": (0.0, 60.0),
    "closing_ahead_s": (-3.0, 3.0),
}
"""Ranges that are the same for every race, for a policy that calls them all: a second must look the same everywhere."""

_LOGARITHMIC: Final = frozenset(name for name in WIDE if "gap" in name)


def _for_any_race(feature: Feature) -> Feature:
    if feature.name not in WIDE:
        return feature
    return replace(feature, fixed=WIDE[feature.name], logarithmic=feature.name in _LOGARITHMIC)


FEATURE_SETS: Final[dict[str, tuple[Feature, ...]]] = {
    "paper": PAPER,
    # without the track's name: figures say what a track is like, and a policy can meet a new one
    "full": tuple(_for_any_race(f) for f in FEATURES if f.name != "track"),
    # with the name instead of the figures, as the paper has it
    "named": tuple(_for_any_race(f) for f in PAPER + EXTRA + FIELD),
}

NO_CAR_GAP_S: Final = 100.0
"""Gap reported where there is no car ahead or behind."""

OUTLOOK_CAP_S: Final = 60.0
"""Largest loss an outlook feature reports; also that of a call without tyres for it."""


def feature_set(name: str) -> tuple[Feature, ...]:
    """The features of a set; raises RsrlError for an unknown name."""
    if name not in FEATURE_SETS:
        raise RsrlError(f"unknown feature set {name!r}; there are {', '.join(FEATURE_SETS)}")
    return FEATURE_SETS[name]


def input_names(name: str) -> tuple[str, ...]:
    """Names of the network input's columns of a set; a category has one column each, as `tyre=soft`."""
    names: list[str] = []
    for feature in feature_set(name):
        names.extend(f"{feature.name}={c}" for c in feature.categories) if feature.kind == "category" else names.append(feature.name)
    return tuple(names)
