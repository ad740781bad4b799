"""Fidelity of what-ifs: coverage of their 95 % intervals, against a much larger sample, and their run time."""

import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.episodes import EpisodeRecorder
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.what_if import Continuation, explain_what_if, options_at
from rsrl.explanation.what_if.comparison import estimate
from rsrl.rollouts import O_POSITION
from rsrl.season import RaceRecord, find_car
from rsrl.simulator import available_cores
from rsrl.statistics import half_width

DRAWS: Final = 200
DRAW_FUTURES: Final = 200
LONG_FUTURES: Final = 20_000

HORIZON_LAPS: Final = 2
"""Laps ahead up to which options are checked for coverage; a whole what-if has more options, of the same kind."""

FIELD_RACES: Final = 16
"""Races called by the policy, from which moments are taken."""

MOMENTS_AT: Final = (0.18, 0.45, 0.75)
"""Share of the race done at each moment."""

Progress = Callable[[int, int], None]


def measure_what_if(
    policy: ExplainedPolicy,
    records: Sequence[RaceRecord],
    *,
    races: int = 2000,
    seed: int = 0,
    draws: int = DRAWS,
    long_futures: int = LONG_FUTURES,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Coverage and run time of what-ifs, over moments of the default car of each record.

    Args:
        races: futures of the what-if whose run time is measured.
        draws: small what-ifs of DRAW_FUTURES futures each; their intervals are compared with the means of `long_futures` other futures.

    Returns:
        coverage: share of intervals that contain the large sample's mean, over all options and moments, with its 95 % interval; draws are
        independent, the options of one draw are not. moments: the same for each moment, with the seconds of a what-if of `races` futures.
    """
    moments = [m for record in records for m in _moments(policy, record, seed)]
    found: list[dict[str, Any]] = []
    by_draw = []
    for done, moment in enumerate(moments, 1):
        held = _coverage(policy, moment, seed, draws, long_futures)
        begun = time.perf_counter()
        explanation = explain_what_if(policy, moment, races=races, seed=seed)
        seconds = time.perf_counter() - begun
        by_draw.append(held.mean(axis=1))
        low, high = np.array(explanation.columns["low"]), np.array(explanation.columns["high"])
        found.append(
            {
                "race": moment.record.name, "lap": moment.lap, "coverage": float(held.mean()), "options": len(explanation.labels),
                "seconds": seconds,
                "largest_half_width": float((high - low).max()) / 2,
            }
        )  # fmt: skip
        if progress:
            progress(done, len(moments))
    overall = estimate(np.concatenate(by_draw))
    return {
        "coverage": overall.mean,
        "coverage_low": overall.low,
        "coverage_high": overall.high,
        "seconds_most": max(row["seconds"] for row in found),
        "seconds_mean": float(np.mean([row["seconds"] for row in found])),
        "races": races,
        "threads": available_cores(),
        "draws": draws,
        "draw_futures": DRAW_FUTURES,
        "long_futures": long_futures,
        "moments": found,
    }


def _moments(policy: ExplainedPolicy, record: RaceRecord, seed: int) -> list[Moment]:
    """One decision from each of several races in which the car is still running on the last of these laps."""
    car = find_car(record, record.default_driver)
    driven = EpisodeRecorder(record, car, FIELD_RACES, policy, states=True).record(seed)
    laps = [max(round(share * record.laps), 2) for share in MOMENTS_AT]
    races = np.flatnonzero(driven.running[laps[-1] - 1])
    return [driven.moment(lap, int(race)) for lap, race in zip(laps, races, strict=False)]


def _coverage(policy: ExplainedPolicy, moment: Moment, seed: int, draws: int, long_futures: int) -> NDArray[np.bool_]:
    """Whether each draw's interval of an option's change in places contains the large sample's mean, bool [draws, options - 1]."""
    options = options_at(policy, moment, HORIZON_LAPS)
    continuation = Continuation(policy, [moment])
    position = continuation.run(options, draws * DRAW_FUTURES + long_futures, seed)[:, :, O_POSITION]
    change = position[:, 1:] - position[:, :1]
    truth = change[draws * DRAW_FUTURES :].mean(axis=0)
    parts = change[: draws * DRAW_FUTURES].reshape(draws, DRAW_FUTURES, -1)
    covered: NDArray[np.bool_] = np.abs(parts.mean(axis=1) - truth) <= half_width(parts, axis=1)
    return covered
