"""Features of past laps for callers without a memory: recent lap times, their slope over the stint, trends of the gaps."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.state import COLUMN, NO_CAR_GAP_S

Floats = NDArray[np.float32]

LAST_LAPS: Final = 5
"""Number of recent laps whose mean is taken."""

TREND_LAPS: Final = 3
"""Number of laps over which the change of a gap is taken."""

HISTORY_COLUMNS: Final = (
    (
        "mean_last_laps_ratio",
        "ratio",
        f"mean of the last {LAST_LAPS} lap times over the reference lap time",
        "last lap",
        ("last_lap_ratio",),
    ),
    ("stint_slope_percent", "%/lap", "change of the lap time a lap, fitted over the stint", "last lap", ("last_lap_ratio", "stops_made")),
    ("gap_ahead_trend_s", "s/lap", f"change of the gap ahead a lap, over {TREND_LAPS} laps", "gap ahead", ("gap_ahead_s",)),
    ("gap_behind_trend_s", "s/lap", f"change of the gap behind a lap, over {TREND_LAPS} laps", "gap behind", ("gap_behind_s",)),
)
"""Name, unit, text, group, and the features that each is computed from."""


class History:
    """History of a batch of races, updated each lap with their raw features."""

    def __init__(self, batch: int) -> None:
        self._ratios: list[Floats] = []
        self._gaps: list[tuple[Floats, Floats]] = []
        self._stops = np.zeros(batch, np.float32)
        self._sums = np.zeros((5, batch))  # of the stint so far: laps n, and sums of t, y, ty, tt for the least-squares slope

    def copy(self) -> "History":
        """An independent copy."""
        other = History(len(self._stops))
        other._ratios, other._gaps = list(self._ratios), list(self._gaps)
        other._stops, other._sums = self._stops.copy(), self._sums.copy()
        return other

    def next_lap(self, raw: Floats) -> dict[str, Floats]:
        """Add raw rows [B, RAW_SIZE] of the next decision; returns every history column by name, float32 [B]."""
        ratio = raw[:, COLUMN["last_lap_ratio"]].copy()
        first = not self._gaps
        if not first:
            self._ratios = [*self._ratios, ratio][-LAST_LAPS:]
            self._add_to_stint(ratio.astype(np.float64), raw[:, COLUMN["stops_made"]].copy())
        gaps = (raw[:, COLUMN["gap_ahead_s"]].copy(), raw[:, COLUMN["gap_behind_s"]].copy())
        self._gaps = [*self._gaps, gaps][-TREND_LAPS - 1 :]
        known = np.array(self._ratios if self._ratios else np.ones((1, len(raw))), np.float64)
        return {
            "mean_last_laps_ratio": known.mean(axis=0).astype(np.float32),
            "stint_slope_percent": self._slope_percent(),
            "gap_ahead_trend_s": self._trend_s(0),
            "gap_behind_trend_s": self._trend_s(1),
        }

    def _add_to_stint(self, ratio: NDArray[np.float64], stops: Floats) -> None:
        """Add the last lap to the stint's sums. A stop resets them and leaves out the lap it was made on."""
        stopped = stops > self._stops
        self._sums[:, stopped] = 0.0
        self._stops = stops
        n = self._sums[0]
        new = np.array([np.ones_like(ratio), n, ratio, n * ratio, n * n])
        self._sums += np.where(stopped, 0.0, new)

    def _slope_percent(self) -> Floats:
        """Least-squares slope in per cent of the reference lap time per lap; 0 with fewer than three laps."""
        n, t, y, ty, tt = self._sums
        below = n * tt - t * t
        return np.where(n >= 3, 100.0 * (n * ty - t * y) / np.where(below > 0, below, 1.0), 0.0).astype(np.float32)

    def _trend_s(self, which: int) -> Floats:
        """Mean change of a gap per lap; 0 where there was no car then, or is none now."""
        then, now = self._gaps[0][which], self._gaps[-1][which]
        there = (then < NO_CAR_GAP_S) & (now < NO_CAR_GAP_S)
        return np.where(there, (now - then) / np.float32(max(len(self._gaps) - 1, 1)), np.float32(0.0)).astype(np.float32)
