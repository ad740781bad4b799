"""Columns that a tree reads: raw features in natural units, one-hot categories, differences between calls, and features of past laps.

A tree compares one column with a threshold, so it needs no scaling. But it cannot subtract two columns and has no memory, so differences
and features of past laps are columns of their own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.state import COLUMN, FIGURES, Feature, feature_set
from rsrl.strategists.tree.history import HISTORY_COLUMNS, History

Floats = NDArray[np.float32]
Source = Literal["feature", "derived", "history"]

_COUNTED_UNITS: Final = frozenset(("laps", "place", "places", "stops", "sets", "cars"))
_MEANS: Final = ("projected_", "rival_stops", "stops_to_come_ahead")


@dataclass(frozen=True)
class TreeColumn:
    """One column of a tree's rows.

    Attributes:
        name: a feature's name, `feature=category`, or the name of a derived column.
        unit, text, group: for people; groups are those of the features.
        kind: "continuous", "boolean", or "category" for the 0/1 column of one category.
        whole: takes integer values only.
        source: "feature", its own value; "derived", from values of the same lap; "history", from past laps.
        feature, category: the feature and category it shows; "" where there is none.
        reads: features it is computed from.
    """

    name: str
    unit: str
    text: str
    group: str
    kind: Literal["continuous", "boolean", "category"] = "continuous"
    whole: bool = False
    source: Source = "feature"
    feature: str = ""
    category: str = ""
    reads: tuple[str, ...] = ()


_Function = Callable[[dict[str, Floats]], Floats]


def _best(values: dict[str, Floats], kind: str) -> Floats:
    return np.minimum(np.minimum(values[f"{kind}_soft_s"], values[f"{kind}_medium_s"]), values[f"{kind}_hard_s"])


def _differences(kind: str, what: str, group: str) -> dict[TreeColumn, _Function]:
    """Columns that compare calls by time to the flag: the best stop against staying out, and compounds against each other."""
    names = {c: f"{kind}_{c}_s" for c in ("stay", "soft", "medium", "hard")}
    best = TreeColumn(
        f"{kind}_stop_gain_s",
        "s",
        f"time the best stop now gains over staying out, {what}",
        group,
        source="derived",
        reads=tuple(names.values()),
    )
    found: dict[TreeColumn, _Function] = {best: lambda v: v[names["stay"]] - _best(v, kind)}
    for one, other in (("soft", "medium"), ("soft", "hard"), ("medium", "hard")):
        text = f"time boxing for {one} gains over boxing for {other}, {what}"
        column = TreeColumn(f"{kind}_{one}_over_{other}_s", "s", text, group, source="derived", reads=(names[one], names[other]))
        found[column] = lambda v, one=one, other=other: v[names[other]] - v[names[one]]  # type: ignore[misc]
    return found


_PLACES: Final = tuple(f"projected_{c}_places" for c in ("soft", "medium", "hard"))
_LEAST_PLACES: Final = TreeColumn(
    "projected_stop_places", "places", "projected places that the best stop costs", "projection", source="derived", reads=_PLACES
)
_DERIVED: Final[dict[TreeColumn, _Function]] = {
    **_differences("expected", "safety cars allowed for", "expected time"),
    **_differences("outlook", "on an empty track", "clean-air outlook"),
    _LEAST_PLACES: lambda v: np.minimum(np.minimum(v[_PLACES[0]], v[_PLACES[1]]), v[_PLACES[2]]),
}
DERIVED_COLUMNS: Final = {column.name: column for column in _DERIVED}
"""Columns computed from several features of the same lap, by name."""

_REPLACED: Final = {"soft_available": "soft_sets", "medium_available": "medium_sets", "hard_available": "hard_sets"}
"""Features that carry less information than another."""

_ALWAYS: Final = ("laps_left", "tyre_age_laps", "stops_made")
"""Features added for a tree of a recurrent policy, which keeps track of them in its own memory."""


def tree_columns(features: str, *, one_race: bool = True) -> tuple[TreeColumn, ...]:
    """Columns of a tree for policies on a feature set; with `one_race`, without columns that are constant within a race."""
    registry = {f.name: f for f in feature_set(features)}
    constant = {"track", *(f.name for f in FIGURES)} if one_race else {"track"}
    names = [n for n in registry if n not in constant and _REPLACED.get(n) not in registry and not (one_race and n == "race_progress")]
    names += [n for n in _ALWAYS if n not in registry]
    found = [column for name in names for column in _of_feature(_feature(name))]
    found += [c for c in DERIVED_COLUMNS.values() if all(name in registry for name in c.reads)]
    return (*found, *HISTORY_COLUMNS_AS_TREE)


def _feature(name: str) -> Feature:
    return next(f for f in feature_set("full") if f.name == name)


def plain_text(feature: Feature) -> str:
    """A feature's text on its own: a text that refers to the feature before it ("the same") is written out."""
    head, same, _ = feature.text.partition(": the same")
    if not same:
        return feature.text
    every = feature_set("full")
    first = next(f for f in every[: every.index(_feature(feature.name))][::-1] if ": the same" not in f.text)
    if ": " in first.text:
        return f"{head}: {first.text.partition(': ')[2]}"
    return first.text.replace("boxing for soft", head)


def _of_feature(feature: Feature) -> list[TreeColumn]:
    f = replace(feature, text=plain_text(feature))
    if f.kind == "category":
        return [
            TreeColumn(f"{f.name}={c}", "", f"{f.text}: {c}", f.group, "category", True, "feature", f.name, c, (f.name,))
            for c in f.categories
        ]
    whole = f.kind == "boolean" or (f.unit in _COUNTED_UNITS and not f.name.startswith(_MEANS))
    return [TreeColumn(f.name, f.unit, f.text, f.group, f.kind, whole, "feature", f.name, "", (f.name,))]


HISTORY_COLUMNS_AS_TREE: Final = tuple(
    TreeColumn(name, unit, text, group, source="history", reads=reads) for name, unit, text, group, reads in HISTORY_COLUMNS
)


def describe(name: str) -> TreeColumn:
    """The column of a name. Raises RsrlError where this version of RSRL has no such column."""
    for column in (*tree_columns("full", one_race=False), *tree_columns("paper", one_race=False)):
        if column.name == name:
            return column
    raise RsrlError(f"a tree reads {name!r}, which this version of RSRL does not have; fit the tree again")


class TreeRows:
    """Computes a tree's input rows from raw features, lap by lap, keeping the history that its history columns need.

    Attributes:
        columns: of the rows.
    """

    def __init__(self, names: Sequence[str]) -> None:
        known = {c.name: c for c in (*tree_columns("full", one_race=False), *tree_columns("paper", one_race=False))}
        if unknown := [name for name in names if name not in known]:
            raise RsrlError(f"a tree reads {unknown[0]!r}, which this version of RSRL does not have; fit the tree again")
        self.columns = tuple(known[name] for name in names)
        plain = [(i, c) for i, c in enumerate(self.columns) if c.source == "feature"]
        self._at = np.array([i for i, _ in plain], np.int64)
        self._from = np.array([COLUMN[c.feature] for _, c in plain], np.int64)
        codes = [float(_feature(c.feature).categories.index(c.category)) if c.category else np.nan for _, c in plain]
        self._codes = np.array(codes, np.float32)
        self._derived = [(i, _DERIVED[c]) for i, c in enumerate(self.columns) if c.source == "derived"]
        self._reads = sorted({name for c in self.columns if c.source == "derived" for name in c.reads})
        self._history = [(i, c.name) for i, c in enumerate(self.columns) if c.source == "history"]

    def begin(self, batch: int) -> None:
        """Start `batch` races with an empty history."""
        self._laps = History(batch)

    def __call__(self, raw: Floats) -> Floats:
        """Rows float32 [B, C] of the next lap of the races, from raw features [B, RAW_SIZE]."""
        rows = np.empty((len(raw), len(self.columns)), np.float32)
        values = raw[:, self._from]
        rows[:, self._at] = np.where(np.isnan(self._codes), values, values == self._codes)
        by_name = {name: raw[:, COLUMN[name]] for name in self._reads}
        for i, function in self._derived:
            rows[:, i] = function(by_name)
        if self._history:
            values_by_name = self._laps.next_lap(raw)
            for i, name in self._history:
                rows[:, i] = values_by_name[name]
        return rows

    def peek(self, raw: Floats) -> Floats:
        """Rows of a hypothetical next lap, from raw features [B, RAW_SIZE]; the history does not change."""
        kept = self._laps
        self._laps = kept.copy()
        rows = self(raw)
        self._laps = kept
        return rows

    def of_race(self, raw: Floats) -> Floats:
        """Rows [T, C] of one race's decisions so far, from its raw features [T, RAW_SIZE]."""
        self.begin(1)
        return np.concatenate([self(raw[t : t + 1]) for t in range(len(raw))])
