"""The table that compares strategists on the same races, with intervals."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsrl.errors import RsrlError
from rsrl.evaluation.gap import gap_closed
from rsrl.evaluation.paired import RaceLog
from rsrl.statistics import Interval, mean_interval


@dataclass(frozen=True)
class Row:
    """One strategist on the leaderboard.

    Attributes:
        strategist: its name.
        mean_position: mean finishing position, all races counted, retirements where they were classified.
        ci95: interval of it (Student's t over races).
        difference: mean over races of this strategist's position less the model's; above zero the model finishes ahead.
        difference_ci95: interval of it, from the paired differences (Student's t).
        p_better: share of races in which the model finishes ahead of this strategist, a tie counting half.
        mean_points: championship points a race.
        mean_stops: stops a race.
        invalid_share: share of races finished out of the rules; a retired car's do not count.
        retired_share: share of races not finished.
        decision_ms: time of one decision when a single race is called.
        gap_closed: share of the gap in mean position from `fixed` to `hindsight` that it closes; None without both of them.
        gap_closed_ci95: interval of it (delta method).
    """

    strategist: str
    mean_position: float
    ci95: Interval
    difference: float
    difference_ci95: Interval
    p_better: float
    mean_points: float
    mean_stops: float
    invalid_share: float
    retired_share: float
    decision_ms: float
    gap_closed: float | None = None
    gap_closed_ci95: Interval | None = None


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
    difference = log.position - model.position
    return Row(
        strategist=log.strategist,
        mean_position=float(log.position.mean()),
        ci95=mean_interval(log.position),
        difference=float(difference.mean()),
        difference_ci95=mean_interval(difference),
        p_better=float((difference > 0).mean() + (difference == 0).mean() / 2),
        mean_points=float(log.points.mean()),
        mean_stops=float(log.stops.mean()),
        invalid_share=float(log.invalid.mean()),
        retired_share=float(log.retired.mean()),
        decision_ms=log.decision_ms,
    )
