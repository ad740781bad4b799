"""The table that compares strategists on the same races, with intervals."""

from collections.abc import Sequence

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.evaluation.gap import gap_closed
from rsrl.evaluation.paired import RaceLog
from rsrl.results import Row
from rsrl.statistics import mean_estimate, paired_difference

Positions = NDArray[np.int64] | NDArray[np.float64]


def leaderboard(model: RaceLog, others: Sequence[RaceLog] = ()) -> list[Row]:
    """Rows of the model and of others against it, best mean position first.

    Raises:
        RsrlError: a log is not of the model's races.
    """
    logs = (model, *others)
    rows = [_row(log, model) for log in logs]
    closed = gap_closed({log.strategist: log for log in logs})
    if closed:
        rows = [replace(row, gap_closed=closed[row.strategist].value, gap_closed_ci95=closed[row.strategist].ci95) for row in rows]
    return sorted(rows, key=lambda row: row.mean_position)


def _row(log: RaceLog, model: RaceLog) -> Row:
    if not np.array_equal(log.races, model.races) or not np.array_equal(log.start, model.start):
        raise RsrlError(f"{log.strategist} and {model.strategist} were not run on the same races; run both with one seed")
    position, difference = mean_estimate(log.position), paired_difference(log.position, model.position)
    return Row(
        strategist=log.strategist,
        mean_position=position.value,
        ci95=position.ci95,
        difference=difference.value,
        difference_ci95=difference.ci95,
        p_better=share_behind(log.position, model.position),
        mean_points=float(log.points.mean()),
        mean_stops=float(log.stops.mean()),
        invalid_share=float(log.invalid.mean()),
        retired_share=float(log.retired.mean()),
        decision_ms=log.decision_ms,
    )


def share_behind(position: Positions, other: Positions) -> float:
    """Share of races in which a position is behind the other, a tie counting half; the arrays are broadcast together."""
    return float((position > other).mean() + (position == other).mean() / 2)
