"""In which ways a row may be moved: how far a step counts, what moves in whole steps, what never moves, what moves one way only, what together.

Columns are those of a tree: raw features in natural units by name, categories by code (`tyre`) or one column each (`tyre=soft`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.state import FEATURES, FIGURES, Feature, feature_set
from rsrl.state.encoding import working_range

Floats = NDArray[np.float32]

FROZEN: Final = frozenset(
    {f.name for f in FIGURES}
    | {"track", "tyre", "stops_made", "valid_finish", "soft_sets", "medium_sets", "hard_sets"}
    | {"soft_available", "medium_available", "hard_available"}
)
"""What nothing that can still happen before the call changes: track, car, set fitted, stops made, sets and compounds used."""

RISES: Final = frozenset({"race_progress", "tyre_age_laps", "tyre_degradation_s"})
FALLS: Final = frozenset({"laps_left", "cars_running"})
CLOCK: Final = ("laps_left", "race_progress", "tyre_age_laps")
"""Move together, a lap at a time; the first one that a tree knows is what a lap costs."""

ORDERED: Final = (
    ("gap_ahead_s", "gap_two_ahead_s"),
    ("gap_ahead_s", "gap_to_leader_s"),
    ("gap_two_ahead_s", "gap_to_leader_s"),
    ("gap_behind_s", "gap_two_behind_s"),
)
"""Pairs of which the second is never less than the first."""

WHOLE_UNITS: Final = frozenset({"laps", "sets", "stops", "place", "places", "cars"})
MEANS: Final = frozenset({"stops_to_come_ahead", "projected_place", "projected_soft_places", "projected_medium_places", "projected_hard_places"})
"""Counted in whole units but averaged, so not whole themselves."""


@dataclass(frozen=True)
class Space:
    """How each of n columns may move from where it is.

    Attributes:
        names: of the columns.
        low, high: range that may be reached, both ends included, float32 [n].
        factor: scaled distance of a natural unit, or of a unit of log(1 + value), float64 [n].
        logarithmic, whole: bool [n].
        nominal: bool [n], a code: any change counts 1.
        groups: columns of each one-hot category.
        fixed_groups: those of them that keep their category.
        clock: columns that move together, lap by lap.
        laps: their values so many laps from now, float32 [laps + 1, len(clock)]; the first row is now.
        orders: (i, j): column j is never less than column i.
    """

    names: tuple[str, ...]
    low: Floats
    high: Floats
    factor: NDArray[np.float64]
    logarithmic: NDArray[np.bool_]
    whole: NDArray[np.bool_]
    nominal: NDArray[np.bool_]
    groups: tuple[tuple[int, ...], ...] = ()
    fixed_groups: frozenset[int] = frozenset()
    clock: tuple[int, ...] = ()
    laps: Floats = field(default_factory=lambda: np.zeros((1, 0), np.float32))
    orders: tuple[tuple[int, int], ...] = ()

    def stretched(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Values [..., n] on the scale their distances are taken on, up to `factor`."""
        wide = np.asarray(values, np.float64)
        return np.where(self.logarithmic, np.log1p(np.maximum(wide, 0.0)), wide)


def space_of(
    names: Sequence[str], x: Floats, record: RaceRecord, features: str, *, frozen: frozenset[str] = FROZEN, most_laps: int = 80
) -> Space:
    """Ways to move a tree's row `x` [n] in a race, distances as the feature set `features` scales them.

    A column that is no raw feature, as a mean over past laps, moves freely; its step counts as that of the feature it is named after.
    """
    base = [name.partition("=")[0] for name in names]
    known: dict[str, Feature] = {f.name: f for f in FEATURES} | {f.name: f for f in feature_set(features)}
    found = [known.get(name) or next((known[k] for k in known if name.startswith(k)), None) for name in base]
    exact = [name in known for name in base]
    one_hot = np.array(["=" in name for name in names])
    low, high = _reach(base, x, found, exact, one_hot, frozen)
    clock = tuple(names.index(n) for n in CLOCK if n in names)
    scales = [_scale(f, record) for f in found]
    return Space(
        names=tuple(names),
        low=low,
        high=high,
        factor=np.array([1.0 if hot else s[0] for s, hot in zip(scales, one_hot, strict=True)]),
        logarithmic=np.array([s[1] and not hot for s, hot in zip(scales, one_hot, strict=True)]),
        whole=np.array([hot or (e and _is_whole(f)) for f, hot, e in zip(found, one_hot, exact, strict=True)]),
        nominal=np.array([e and f is not None and f.kind == "category" and not hot for f, hot, e in zip(found, one_hot, exact, strict=True)]),
        **_groups(base, one_hot, frozen),
        clock=clock,
        laps=_clock_values(names, clock, x, record.laps, most_laps),
        orders=tuple((names.index(a), names.index(b)) for a, b in ORDERED if a in names and b in names),
    )


def _reach(
    base: Sequence[str], x: Floats, found: Sequence[Feature | None], exact: Sequence[bool], one_hot: NDArray[np.bool_], frozen: frozenset[str]
) -> tuple[Floats, Floats]:
    low, high = np.full(len(x), -np.inf, np.float32), np.full(len(x), np.inf, np.float32)
    for i, (name, feature) in enumerate(zip(base, found, strict=True)):
        if one_hot[i] or (exact[i] and feature is not None and feature.kind == "boolean"):
            low[i], high[i] = 0.0, 1.0
        elif exact[i] and feature is not None and feature.kind == "category":
            low[i], high[i] = 0.0, len(feature.categories) - 1.0
        elif exact[i] and feature is not None and feature.low == 0.0 or "gap" in name:
            low[i] = 0.0
        if name in frozen and not one_hot[i]:
            low[i] = high[i] = x[i]
        if name in RISES:
            low[i] = x[i]
        if name in FALLS:
            high[i] = x[i]
    return low, high


def _scale(feature: Feature | None, record: RaceRecord) -> tuple[float, bool]:
    """Scaled distance of a unit, as `state.Encoder` scales, and whether it is one of the logarithm. What has no range counts nothing."""
    if feature is None or feature.kind == "category":
        return (1.0, False) if feature is not None else (0.0, False)
    low, high = working_range(feature, record.scaling)
    if feature.logarithmic:
        low, high = float(np.log1p(low)), float(np.log1p(high))
    return (1.0 - feature.low) / (high - low), feature.logarithmic


def _is_whole(feature: Feature | None) -> bool:
    if feature is None:
        return False
    return feature.kind != "continuous" or (feature.unit in WHOLE_UNITS and feature.name not in MEANS)


def _groups(base: Sequence[str], one_hot: NDArray[np.bool_], frozen: frozenset[str]) -> Mapping[str, object]:
    members: dict[str, list[int]] = {}
    for i in np.flatnonzero(one_hot):
        members.setdefault(base[i], []).append(int(i))
    fixed = frozenset(g for g, name in enumerate(members) if name in frozen)
    return {"groups": tuple(tuple(m) for m in members.values()), "fixed_groups": fixed}


def _clock_values(names: Sequence[str], clock: tuple[int, ...], x: Floats, race_laps: int, most: int) -> Floats:
    """Values of the columns that tell the time, now and so many laps from now, up to the last decision that allows a stop."""
    if not clock:
        return np.zeros((1, 0), np.float32)
    first = clock[0]
    done = race_laps - float(x[first]) if names[first] == "laps_left" else float(x[first])
    if names[first] == "race_progress":
        done = round(float(x[first]) * race_laps)
    ahead = np.arange(0, (min(most, max(int(race_laps - 1 - done), 0)) if names[first] != "tyre_age_laps" else most) + 1)
    columns = []
    for i in clock:
        if names[i] == "laps_left":
            columns.append((x[i] - ahead).astype(np.float32))
        elif names[i] == "race_progress":  # in single precision, as the observer has it
            columns.append((np.float32(done) + ahead).astype(np.float32) / np.float32(race_laps))
        else:
            columns.append((x[i] + ahead).astype(np.float32))
    return np.stack(columns, axis=1)
