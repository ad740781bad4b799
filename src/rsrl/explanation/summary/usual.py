"""Where a state is one the policy does not know: another race or car than it trained for, figures, features, and laps it never drove."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.quantities import bare, feature_text, quantity
from rsrl.season import GROUPS, RaceRecord, group_races, race_hash
from rsrl.state import COLUMN, FEATURES, NO_CAR_GAP_S, Feature
from rsrl.state.encoding import working_range
from rsrl.strategists import outside_training

Floats = NDArray[np.float64]

RACES: Final = 256
"""Simulated races that tell what is usual at a lap."""

USUAL_SEED: Final = 4_000_000_000
"""Names those races: below 2**32, and no seed of training or of an evaluation."""

LAPS_AROUND: Final = 1
ROOM: Final = 0.1
"""Share of a feature's usual span by which a value may lie beyond it before it is told."""

SATURATING: Final = ("clean-air outlook", "expected time", "projection")
"""Groups whose features stop rising on purpose: beyond the range a call is bad, and how bad does not matter."""

COUNTS: Final = ("cars",)
"""Units of counts, cut off on purpose too: at the start of every race more cars are near than the scale has room for."""


def state_warnings(policy: ExplainedPolicy, moment: Moment, *, drive_races: bool = False) -> list[str]:
    """What of a decision lies outside what the policy knows, a line each; none where all is known.

    Args:
        drive_races: also ask whether such a state comes up in races that the policy calls; worth its time for a state from outside.
    """
    lines = _other_training(policy, moment)
    if not lines:  # of a policy for one car each figure of another's would be told
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
    """Features the policy sees cut off: what lies beyond it can't tell apart."""
    lines = []
    for one, value in _measured(policy, moment.record, moment):
        low, high = working_range(one, moment.record.scaling)
        room = ROOM * (high - low)
        if one.group not in SATURATING and one.unit not in COUNTS and not low - room <= value <= high + room:
            lines.append(f"{feature_text(one)} is {quantity(one, value)}; the policy tells nothing apart beyond {_span(one, low, high)}")
    return lines


def _measured(policy: ExplainedPolicy, record: RaceRecord, moment: Moment) -> list[tuple[Feature, float]]:
    """The continuous features the policy reads, with their values; a gap to a car there is not has none."""
    row = moment.raw[-1]
    values = [(one, float(row[COLUMN[one.name]])) for one in policy.encoder(record).features if one.kind == "continuous"]
    return [(one, value) for one, value in values if not ("gap" in one.name and value >= NO_CAR_GAP_S)]


def _never_seen(policy: ExplainedPolicy, moment: Moment) -> list[str]:
    """Features outside what simulated races have, which the policy calls itself, a lap around the one at hand."""
    low, high = usual_span(policy, moment.record, moment.car, moment.lap)
    lines = []
    for one, value in _measured(policy, moment.record, moment):
        i = COLUMN[one.name]
        room = ROOM * (high[i] - low[i])
        if not low[i] - room <= value <= high[i] + room:
            usual = _span(one, float(low[i]), float(high[i]))
            lines.append(f"{feature_text(one)} is {quantity(one, value)}; in {RACES} simulated races it is {usual} at this lap")
    return lines


def _span(one: Feature, low: float, high: float) -> str:
    return f"{bare(one, low)} to {quantity(one, high)}"


def usual_span(policy: ExplainedPolicy, record: RaceRecord, car: int, lap: int) -> tuple[Floats, Floats]:
    """Lowest and highest raw features [RAW_SIZE] around a lap, over races that the policy calls."""
    environment = RaceEnvironment(record, car, batch=RACES)
    races = np.arange(RACES, dtype=np.int64)
    environment.reset(USUAL_SEED, races)
    strategist = policy.strategist(record)
    strategist.begin(environment, USUAL_SEED, races)
    rows = []
    for driven in range(1, min(lap + LAPS_AROUND, record.laps) + 1):
        if driven >= lap - LAPS_AROUND:
            rows.append(environment.raw[~environment.done].copy())
        environment.step(strategist.decide(environment))
    known = np.concatenate(rows)
    gaps = [i for i, one in enumerate(FEATURES) if "gap" in one.name]
    shown = known.astype(np.float64)
    shown[:, gaps] = np.where(shown[:, gaps] >= NO_CAR_GAP_S, np.nan, shown[:, gaps])
    with np.errstate(all="ignore"):
        return np.nanmin(shown, axis=0), np.nanmax(shown, axis=0)
