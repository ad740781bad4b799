"""Options compared with the policy's own call, future by future: places, points, chances, where the car rejoins, and the lap time split."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl import rollouts as out
from rsrl.season import FIELD_SIZE
from rsrl.simulator import POINTS_BY_POSITION
from rsrl.statistics import mean_interval, student_interval

EQUAL_PLACES: Final = 0.05
"""Two options are called equal if their difference may be zero, is measured as less than this, ..."""

NARROW_PLACES: Final = 0.1
"""... and its 95 % interval is at most twice this wide; otherwise the comparison is undecided."""

GRID_PER_S: Final = 2.0**20
"""Times are rounded to whole 2**-20 s, about a microsecond: sums of such numbers are exact in double precision, in any order."""

PARTS: Final = ("pit_s", "tyre_s", "traffic_s", "safety_car_s")
"""The parts of a difference in race time; `traffic_s` is the remainder of the other three."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A mean with standard error and 95 % interval."""

    mean: float
    se: float
    low: float
    high: float


@dataclass(frozen=True)
class Comparison:
    """One option against the reference, in the same futures.

    Attributes:
        places, points: change in finishing position and in points; a negative change of position is better.
        simultaneous: interval of `places` with 95 % coverage jointly over all options, by Bonferroni.
        verdict: "better", "worse", "equal" or "undecided"; "itself" for the reference.
        chance_gain, chance_lose: share of futures with a better and with a worse finish.
        mean_position: of the option.
        positions: share of futures finished 1st, 2nd ..., for `FIELD_SIZE` places, and more where an option finishes further back.
        stops: share of futures in which the car stops at all after this moment.
        stop_lap, rejoin_place: mean lap and rejoin position of the first stop; rejoin_ahead_s, rejoin_behind_s: median gaps there. None
            without a stop.
        stop_laps: 10 % and 90 % quantile of the lap of the first stop.
        time_s: mean difference in race time over the futures that reach the flag; parts: its split, in the order of PARTS.
        finished: share of futures that reach the flag.
    """

    places: Estimate
    points: Estimate
    simultaneous: tuple[float, float]
    verdict: str
    chance_gain: float
    chance_lose: float
    mean_position: float
    positions: tuple[float, ...]
    stops: float
    stop_lap: float | None
    stop_laps: tuple[int, int] | None
    rejoin_place: float | None
    rejoin_ahead_s: float | None
    rejoin_behind_s: float | None
    time_s: float
    parts: tuple[float, float, float, float]
    finished: float


def compare(results: Floats, reference: int) -> list[Comparison]:
    """Every option of results [futures, options, O_COLUMNS] (`rollouts.batch_kernels`) against option number `reference`, in order."""
    others = max(results.shape[1] - 1, 1)
    last = max(FIELD_SIZE, int(results[:, :, out.O_POSITION].max()))
    return [_compare(results[:, j], results[:, reference], others, last, itself=j == reference) for j in range(results.shape[1])]


def _compare(option: Floats, reference: Floats, others: int, last: int, *, itself: bool) -> Comparison:
    change = option[:, out.O_POSITION] - reference[:, out.O_POSITION]
    places = estimate(change)
    simultaneous = student_interval(places.mean, places.se, max(len(change) - 1, 1), others)
    stopped = option[option[:, out.O_STOP_LAP] > 0]
    both = (option[:, out.O_FINISHED] > 0) & (reference[:, out.O_FINISHED] > 0)
    parts = mean_split(option[both], reference[both])
    position = option[:, out.O_POSITION].astype(np.int64)
    return Comparison(
        places=places,
        points=estimate(POINTS_BY_POSITION[position] - POINTS_BY_POSITION[reference[:, out.O_POSITION].astype(np.int64)]),
        simultaneous=simultaneous,
        verdict="itself" if itself else verdict(places, simultaneous),
        chance_gain=float((change < 0).mean()),
        chance_lose=float((change > 0).mean()),
        mean_position=float(position.mean()),
        positions=tuple(float(s) for s in np.bincount(position, minlength=last + 1)[1:] / len(position)),
        stops=len(stopped) / len(option),
        stop_lap=_mean(stopped[:, out.O_STOP_LAP]),
        stop_laps=_inner_laps(stopped[:, out.O_STOP_LAP]),
        rejoin_place=_mean(stopped[:, out.O_PLACE]),
        rejoin_ahead_s=_median(stopped[:, out.O_AHEAD]),
        rejoin_behind_s=_median(stopped[:, out.O_BEHIND]),
        time_s=sum(parts),
        parts=parts,
        finished=float((option[:, out.O_FINISHED] > 0).mean()),
    )


def estimate(values: Floats) -> Estimate:
    """Mean of at least two values [n] with its 95 % interval by Student's t."""
    return Estimate(float(values.mean()), float(values.std(ddof=1)) / math.sqrt(len(values)), *mean_interval(values))


def verdict(places: Estimate, simultaneous: tuple[float, float]) -> str:
    """Verdict on a difference in places.

    "better" or "worse" only if the simultaneous interval excludes zero, so the chance of any false verdict of this kind among all options
    of one question is at most 5 %. "equal" if it includes zero, the mean is small and the 95 % interval is narrow. Else "undecided".
    """
    if simultaneous[1] < 0:
        return "better"
    if simultaneous[0] > 0:
        return "worse"
    narrow = places.high - places.low <= 2 * NARROW_PLACES
    return "equal" if abs(places.mean) < EQUAL_PLACES and narrow else "undecided"


def split(option: Floats, reference: Floats) -> Floats:
    """Differences in time race by race, float64 [n, 4] in the order of PARTS, from results [n, O_COLUMNS] of races that reach the flag.

    Each row sums exactly to the difference in race time in whole 2**-20 s.
    """
    columns = [out.O_TIME, out.O_PIT, out.O_TYRE, out.O_SLOW]
    total, pit, tyre, slow = on_grid(option[:, columns] - reference[:, columns]).T
    return np.stack([pit, tyre, total - pit - tyre - slow, slow], axis=1)


def mean_split(option: Floats, reference: Floats) -> tuple[float, float, float, float]:
    """Means of `split` in whole 2**-20 s, so that they sum exactly to the mean difference; zeros where no race reaches the flag."""
    if not len(option):
        return 0.0, 0.0, 0.0, 0.0
    races = split(option, reference)
    total = on_grid(races.sum(axis=1).mean())
    pit, tyre, _, slow = on_grid(races.mean(axis=0))
    return float(pit), float(tyre), float(total - pit - tyre - slow), float(slow)


def on_grid(values: Floats) -> Floats:
    """Rounded to whole 2**-20 s."""
    return np.rint(np.asarray(values) * GRID_PER_S) / GRID_PER_S


def _mean(values: Sequence[float] | Floats) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _inner_laps(laps: Floats) -> tuple[int, int] | None:
    """10 % and 90 % quantile of laps; None without any."""
    if not len(laps):
        return None
    low, high = np.quantile(laps, (0.1, 0.9), method="inverted_cdf")
    return int(low), int(high)


def _median(values: Floats) -> float | None:
    there = values[~np.isnan(values)]
    return float(np.median(there)) if len(there) else None
