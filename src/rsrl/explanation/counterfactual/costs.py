"""What a change costs: scaled distance of its causes, as the policy's encoder scales them."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSE, CAUSES
from rsrl.explanation.counterfactual.nearest import Norm, cost_of
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, FEATURES, feature_set
from rsrl.state.encoding import working_range

Floats = NDArray[np.float32]
LATER, CALLED = CAUSE["laps_later"], CAUSE["laps_called"]
MEASURED_BY: Final = {
    "laps_later": "laps_left",
    "laps_called": "laps_left",
    "time_lost_s": "gap_ahead_s",
    "gap_ahead_s": "gap_ahead_s",
    "gap_behind_s": "gap_behind_s",
    "laps_older": "tyre_age_laps",
    "soft_sets": "soft_sets",
    "medium_sets": "medium_sets",
    "hard_sets": "hard_sets",
}
"""The feature whose range says how far a step of a cause is. A cause that is no number counts 1."""

BY_THEN: Final = {"gap_ahead_s": "gap_ahead_s", "gap_behind_s": "gap_behind_s", "track_status": "safety_car"}
"""Causes that start from what is expected by the time at which they are to hold, and the feature that tells it."""


class Costs:
    """Distances of changes from one moment.

    Args:
        features: the policy's feature set; a feature it lacks is scaled as it is elsewhere.
        raw: raw row of the moment.
        staying, called: raw rows expected so many laps from now, staying out and as the policy calls, [laps + 1, RAW_SIZE], the first is
            now.
    """

    def __init__(self, record: RaceRecord, features: str, raw: Floats, staying: Floats, called: Floats) -> None:
        known = {f.name: f for f in FEATURES} | {f.name: f for f in feature_set(features)}
        self._factor, self._logarithmic = np.ones(len(CAUSES)), np.zeros(len(CAUSES), np.bool_)
        for cause, name in MEASURED_BY.items():
            low, high = working_range(known[name], record.scaling)
            if known[name].logarithmic:
                low, high = float(np.log1p(low)), float(np.log1p(high))
            self._factor[CAUSE[cause]] = (1.0 - known[name].low) / (high - low)
            self._logarithmic[CAUSE[cause]] = known[name].logarithmic
        if "laps_left" not in {f.name for f in feature_set(features)}:
            self._factor[[LATER, CALLED]] = 1.0 / record.laps  # the policy reads the race's progress instead
        self._raw, self._staying, self._called = raw, staying, called

    def starts(self, rows: Floats) -> NDArray[np.float64]:
        """Where each cause of changes [N, causes] starts from, float64 [N, causes]."""
        starts = np.zeros(rows.shape)
        later, called = (np.nan_to_num(rows[:, c]).astype(np.int64) for c in (LATER, CALLED))
        called, later = np.minimum(called, len(self._called) - 1), np.minimum(later, len(self._staying) - 1)
        for cause, name in BY_THEN.items():
            by_then = self._called[called, COLUMN[name]], self._staying[later, COLUMN[name]]
            starts[:, CAUSE[cause]] = np.where(called > 0, *by_then)
        starts[:, CAUSE["compounds_used"]] = 1.0 + self._raw[COLUMN["valid_finish"]]
        for cause in ("soft_sets", "medium_sets", "hard_sets"):
            starts[:, CAUSE[cause]] = self._raw[COLUMN[cause]]
        return starts

    def distances(self, rows: Floats, starts: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Scaled distance of each cause of changes [N, causes]; 0 where it stays. `starts`: where they start from, if known better."""
        starts, ends = self.starts(rows) if starts is None else starts, rows.astype(np.float64)
        ends = np.where(np.isnan(ends), starts, ends)
        straight = np.abs(ends - starts)
        bent = np.abs(np.log1p(np.maximum(ends, 0.0)) - np.log1p(np.maximum(starts, 0.0)))
        distances: NDArray[np.float64] = np.where(self._logarithmic, bent, straight) * self._factor
        distances[:, CAUSE["track_status"]] = (straight[:, CAUSE["track_status"]] > 0).astype(np.float64)
        return distances

    def order(self, rows: Floats, norm: Norm) -> NDArray[np.int64]:
        """Changes with the fewest causes first, the nearest of them first."""
        distances = self.distances(rows)
        causes = (~np.isnan(rows)).sum(axis=1)
        return np.lexsort((distances.sum(axis=1), cost_of(distances, ~np.isnan(rows), norm), causes))
