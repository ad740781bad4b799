"""Warnings that a state lies outside the policy's training: another race or car, features beyond its scale, situations it never met."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.episodes import EpisodeRecorder
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.quantities import bare, feature_text, quantity
from rsrl.season import GROUPS, RaceRecord, group_races, race_hash
from rsrl.state import COLUMN, FEATURES, NO_CAR_GAP_S, Feature
from rsrl.state.encoding import working_range
from rsrl.strategists import outside_training

Floats = NDArray[np.float64]

RACES: Final = 256
"""Simulated races that give the usual range of each feature at a lap."""

USUAL_SEED: Final = 4_000_000_000
"""Seed of those races. Training and evaluations do not use it."""

LAPS_AROUND: Final = 1
ROOM: Final = 0.1
"""A value is reported once it lies outside the usual range by more than this share of the range."""

SATURATING: Final = ("clean-air outlook", "expected time", "projection")
"""Groups whose features saturate by design: beyond the range a call is bad, and how bad does not matter."""

COUNTS: Final = ("cars",)
"""Units of counts, which saturate too: at every start more cars are near than the scale covers."""


def state_warnings(policy: ExplainedPolicy, moment: Moment, *, drive_races: bool = False) -> list[str]:
    """What lies outside the policy's training at a decision, a line each; empty if nothing does.

    Args:
        drive_races: also compare with simulated races that the policy calls; takes seconds, meant for a state from a file.
    """
    lines = _other_training(policy, moment)
    if not lines:  # a policy of one car would otherwise be warned of every figure of another car
        lines = outside_training(policy.about, moment.record, moment.car)
    lines += _beyond_the_scale(policy, moment)
    return lines + (_never_seen(policy, moment) if drive_races else [])


def _other_training(policy: ExplainedPolicy, moment: Moment) -> list[str]:
    about, record = policy.about, moment.record
    lines = []
    trained = group_races(about.race) if about.race in GROUPS else tuple(about.race.split(","))
    if about.race and record.name not in trained and not about.trained_range:
        lines.append(f"the policy was trained on {about.race} alone, not on {record.name}")
    elif about.race == record.name and about.season_hash and about.season_hash != race_hash(record):
        lines.append(f"the figures of {record.name} are not those the policy was trained on")
    if about.driver and about.driver != moment.driver:
        lines.append(f"the policy was trained to call {about.driver}, not {moment.driver}")
    return lines


def _beyond_the_scale(policy: ExplainedPolicy, moment: Moment) -> list[str]:
    """Features beyond the policy's scale, where it cannot tell values apart."""
    lines = []
    for one, value in _measured(policy, moment.record, moment):
        low, high = working_range(one, moment.record.scaling)
        room = ROOM * (high - low)
        if one.group not in SATURATING and one.unit not in COUNTS and not low - room <= value <= high + room:
            lines.append(
                f"{feature_text(one)} is {quantity(one, value)}; the policy cannot tell values apart outside {_span(one, low, high)}"
            )
    return lines


def _measured(policy: ExplainedPolicy, record: RaceRecord, moment: Moment) -> list[tuple[Feature, float]]:
    """The continuous features that the policy reads, with their values; a gap without a car has none."""
    row = moment.raw[-1]
    values = [(one, float(row[COLUMN[one.name]])) for one in policy.encoder(record).features if one.kind == "continuous"]
    return [(one, value) for one, value in values if not ("gap" in one.name and value >= NO_CAR_GAP_S)]


def _never_seen(policy: ExplainedPolicy, moment: Moment) -> list[str]:
    """Features outside their range in simulated races that the policy calls, within a lap of this one."""
    low, high = usual_span(policy, moment.record, moment.car, moment.lap)
    lines = []
    for one, value in _measured(policy, moment.record, moment):
        i = COLUMN[one.name]
        room = ROOM * (high[i] - low[i])
        if not low[i] - room <= value <= high[i] + room:
            usual = _span(one, float(low[i]), float(high[i]))
            lines.append(f"{feature_text(one)} is {quantity(one, value)}; in {RACES} simulated races it is {usual} on this lap")
    return lines


def _span(one: Feature, low: float, high: float) -> str:
    return f"{bare(one, low)} to {quantity(one, high)}"


def usual_span(policy: ExplainedPolicy, record: RaceRecord, car: int, lap: int) -> tuple[Floats, Floats]:
    """Lowest and highest raw features [RAW_SIZE] from a lap before to a lap after `lap`, over races that the policy calls."""
    last = min(lap + LAPS_AROUND, record.laps)
    episodes = EpisodeRecorder(record, car, RACES, policy).record(USUAL_SEED, before_lap=last)
    around = slice(max(lap - LAPS_AROUND, 1) - 1, last)
    known = episodes.raw[around][episodes.running[around]].astype(np.float64)
    gaps = [i for i, one in enumerate(FEATURES) if "gap" in one.name]
    known[:, gaps] = np.where(known[:, gaps] >= NO_CAR_GAP_S, np.nan, known[:, gaps])
    with np.errstate(all="ignore"):
        return np.nanmin(known, axis=0), np.nanmax(known, axis=0)
