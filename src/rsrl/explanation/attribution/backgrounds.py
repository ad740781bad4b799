"""Backgrounds: the inputs that replace those of absent players, and so what a state is compared with.

- `average`: TimeSHAP's background (Bento et al., 2021), one average event on every lap: the mean encoded row over many simulated races.
  No car can be in that state: a one-hot has the mean (0.4 soft, 0.35 medium, 0.25 hard), and linked features are averaged apart.
- `lap_aligned`: the same laps of reference races. Each reference is a real state, and values are means over them. The lap number is the
  same in all of them, so its Shapley value is zero.
- chosen: a `Moment`, or a raw row in a JSON file.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.episodes import EpisodeRecorder
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, FEATURES, RAW_SIZE, Feature, feature_set
from rsrl.text_files import read_text

Floats = NDArray[np.float32]
BackgroundName = Literal["average", "lap_aligned"]
BACKGROUNDS: Final = ("average", "lap_aligned")

REFERENCE_SEED: Final = 611_953
"""Seed of the reference races. No evaluation uses it, and training seeds lie above a million."""

REFERENCE_RACES: Final = 64
"""Races simulated for a background."""

ALIGNED: Final = 32
ALIGNED_RECURRENT: Final = 8
"""References of a lap-aligned background; fewer for a recurrent policy, which goes through every lap for each coalition."""


@dataclass(frozen=True)
class ReferenceRaces:
    """Races that the policy called for the same car: raw rows float32 [R, L, RAW_SIZE] and whether each was still running, bool [R, L]."""

    raw: Floats
    running: NDArray[np.bool_]


@dataclass(frozen=True)
class Background:
    """Inputs that replace those of absent players.

    Attributes:
        name: "average", "lap_aligned" or "chosen".
        text: the background in words, to follow "for".
        features: encoded references float32 [K, T, F]; values are means over the K.
        shown: raw rows float32 [R, RAW_SIZE] that describe the background to people on the lap explained: by their mean where the network
            is given the mean (`average`), else by their median.
    """

    name: str
    text: str
    features: Floats
    shown: Floats


def drive_references(
    policy: ExplainedPolicy, record: RaceRecord, car: int, races: int = REFERENCE_RACES, seed: int = REFERENCE_SEED
) -> ReferenceRaces:
    """Simulate `races` races that the policy calls. They serve every lap of the race: keep them to explain more than one decision."""
    episodes = EpisodeRecorder(record, car, races).record(seed, driver=policy.strategist(record))
    return ReferenceRaces(np.ascontiguousarray(episodes.raw.transpose(1, 0, 2)), episodes.running.T)


def make_background(
    policy: ExplainedPolicy, moment: Moment, chosen: "BackgroundName | Moment | Path | str", references: ReferenceRaces | None = None
) -> Background:
    """The background of a decision; `references` are simulated where none are given.

    Raises:
        RsrlError: no such background, a file that holds no state of the policy's features, or no reference race lasts to the lap.
    """
    if isinstance(chosen, Moment):
        return _from_rows(policy, moment, chosen.raw, f"{chosen.driver} on lap {chosen.lap} of {chosen.record.name}")
    if str(chosen) not in BACKGROUNDS:
        if not str(chosen).endswith(".json"):
            raise RsrlError(f"unknown background {str(chosen)!r}; there are {', '.join(BACKGROUNDS)}, and a state in a .json file")
        return _from_rows(policy, moment, read_row(Path(chosen), policy.agent.feature_set)[None], f"the state in {Path(chosen).name}")
    races = references or drive_references(policy, moment.record, moment.car)
    return _average(policy, moment, races) if chosen == "average" else _aligned(policy, moment, races)


def _average(policy: ExplainedPolicy, moment: Moment, races: ReferenceRaces) -> Background:
    shown = races.raw[races.running]
    mean = policy.encoder(moment.record)(shown).mean(axis=0, dtype=np.float64).astype(np.float32)
    text = f"the average event of {len(races.raw)} races of {moment.driver}"
    return Background("average", text, np.tile(mean, (1, len(moment.raw), 1)), shown)


def _aligned(policy: ExplainedPolicy, moment: Moment, races: ReferenceRaces) -> Background:
    laps = len(moment.raw)
    chosen = np.flatnonzero(races.running[:, laps - 1])[: ALIGNED_RECURRENT if policy.recurrent else ALIGNED]
    if not len(chosen):
        raise RsrlError(f"none of {len(races.raw)} reference races of {moment.driver} lasts to lap {moment.lap}; use `average`")
    raw = races.raw[chosen, :laps]
    encoder = policy.encoder(moment.record)
    text = f"{len(chosen)} other races of {moment.driver} on the same lap"
    return Background("lap_aligned", text, np.stack([encoder(rows) for rows in raw]), raw[:, -1])


def _from_rows(policy: ExplainedPolicy, moment: Moment, raw: Floats, text: str) -> Background:
    """The rows themselves where there are as many laps, else the last row on every lap, as with the average event."""
    if raw.ndim != 2 or raw.shape[1] != RAW_SIZE:
        raise RsrlError(f"background: {text} has rows of {raw.shape[-1]} features, this version has {RAW_SIZE}")
    rows = raw if len(raw) == len(moment.raw) else np.tile(raw[-1], (len(moment.raw), 1))
    return Background("chosen", text, policy.encoder(moment.record)(rows)[None], raw[-1:])


def read_row(path: Path, name: str) -> Floats:
    """A raw row [RAW_SIZE] from a JSON object of feature names and values; categories by name, booleans as true and false.

    It must have every feature of the set `name`; other features of the registry are optional, and zero where they are left out.

    Raises:
        RsrlError: no such file, not such an object, or a feature that is missing, unknown or impossible, by name.
    """
    try:
        values = json.loads(read_text(path))
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise RsrlError(f"{path}: is not JSON") from None
    if not isinstance(values, dict):
        raise RsrlError(f"{path}: must hold an object of feature names and values")
    row = np.zeros(RAW_SIZE, np.float32)
    for key, value in values.items():
        if key not in COLUMN:
            raise RsrlError(f"{path}: {key} is no feature of this version; it belongs to another schema")
        row[COLUMN[key]] = _checked(FEATURES[COLUMN[key]], value, path)
    for feature in feature_set(name):
        if feature.name not in values:
            raise RsrlError(f"{path}: lacks {feature.name}, which the policy reads")
    return row


def _checked(feature: Feature, value: Any, path: Path) -> float:
    if feature.kind == "category":
        if value in feature.categories:
            return float(feature.categories.index(value))
        raise RsrlError(f"{path}: {feature.name} is {value!r}; it is one of {', '.join(feature.categories)}")
    if feature.kind == "boolean":
        if value in (True, False):
            return float(value)
        raise RsrlError(f"{path}: {feature.name} is {value!r}; it is true or false")
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise RsrlError(f"{path}: {feature.name} is {value!r}; it is a number of {feature.unit or 'no unit'}")
    return float(value)
