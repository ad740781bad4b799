"""What-if: every option is rolled out in the same futures, the policy calling afterwards, and compared with the policy's own call."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rsrl.errors import RsrlError
from rsrl.explanation.from_state import under_status
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import AnyPolicy
from rsrl.explanation.result import Explanation
from rsrl.explanation.what_if.comparison import EQUAL_PLACES, NARROW_PLACES, PARTS, Comparison, compare
from rsrl.explanation.what_if.continuation import Continuation
from rsrl.explanation.what_if.options import label, options_at
from rsrl.explanation.what_if.sentences import sentences_of
from rsrl.rollouts import Option, Progress
from rsrl.season import GREEN, SC, TRACK_STATUS_NAMES, VSC
from rsrl.simulator import layout as at

STATUS_TEXT = {GREEN: "", VSC: "if a virtual safety car came out now", SC: "if a safety car came out now"}


def explain_what_if(
    policy: AnyPolicy,
    moment: Moment,
    *,
    races: int = 2000,
    seed: int = 0,
    horizon_laps: int = 8,
    status: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Explanation:
    """Change in mean finishing position by option, against the policy's own call.

    Options: box now for each legal compound; stay out and leave the rest to the policy; stay out and box in 1 to `horizon_laps` laps for
    the compound that the policy prefers. All options meet the same `races` futures (common random numbers), in which everything that
    a pit wall cannot see is drawn anew, the car's own retirement included. After the option's call the policy calls.

    Args:
        status: replaces the track status of the moment: 1 a virtual safety car has just come out, 2 a safety car; None keeps it.
        threads: how many; results do not depend on it.

    Returns:
        One row for each option, the policy's own call first with value 0. If only one call is legal and no stop can come later, that row
        alone.

    Raises:
        RsrlError: fewer than 2 races, a negative seed, a horizon out of range, a status that is impossible on this lap.
    """
    if races < 2:
        raise RsrlError(f"races is {races}; a what-if needs at least 2")
    if seed < 0:
        raise RsrlError(f"seed is {seed}; it must not be negative")
    there = moment if status is None else under_status(moment, status)
    options = options_at(policy, there, horizon_laps)
    results = Continuation(policy, [there]).run(options, races, seed, threads=threads, progress=progress)
    compared = compare(results, 0)
    decision = policy.decide(there)
    suffix = f", {STATUS_TEXT[status]}" if status else ""
    return Explanation(
        method="what-if",
        decision=decision,
        question=f"change in finishing position against {label(options[0])}, the policy's call for lap {there.lap}{suffix}",
        unit="places",
        labels=tuple(label(o) + (" (its call)" if i == 0 else "") for i, o in enumerate(options)),
        values=np.array([c.places.mean for c in compared]),
        exact=False,
        budget=races * len(options),
        standard_errors=np.array([c.places.se for c in compared]),
        columns=_columns(options, compared),
        details=_details(there, options, compared, races, seed, horizon_laps),
        sentences=sentences_of(there, decision, options, compared, races, suffix),
    )


def _columns(options: Sequence[Option], compared: Sequence[Comparison]) -> dict[str, list[Any]]:
    columns: dict[str, list[Any]] = {
        "call": [o.call for o in options],
        "in_laps": [o.offset for o in options],
        "low": [c.places.low for c in compared],
        "high": [c.places.high for c in compared],
        "verdict": [c.verdict for c in compared],
        "mean_position": [c.mean_position for c in compared],
        "points": [c.points.mean for c in compared],
        "points_low": [c.points.low for c in compared],
        "points_high": [c.points.high for c in compared],
        "chance_gain": [c.chance_gain for c in compared],
        "chance_lose": [c.chance_lose for c in compared],
        "stop_lap": [c.stop_lap for c in compared],
        "stop_laps": [None if c.stop_laps is None else list(c.stop_laps) for c in compared],
        "rejoin_place": [c.rejoin_place for c in compared],
        "rejoin_gap_ahead_s": [c.rejoin_ahead_s for c in compared],
        "rejoin_gap_behind_s": [c.rejoin_behind_s for c in compared],
        "time_s": [c.time_s for c in compared],
    }
    for i, part in enumerate(PARTS):
        columns[part] = [c.parts[i] for c in compared]
    return columns


def _details(
    moment: Moment, options: Sequence[Option], compared: Sequence[Comparison], races: int, seed: int, horizon_laps: int
) -> dict[str, Any]:
    best = min(range(len(options)), key=lambda i: compared[i].places.mean)
    return {
        "races": races,
        "seed": seed,
        "horizon_laps": horizon_laps,
        "track_status": TRACK_STATUS_NAMES[int(moment.arrays[2][at.R_STATUS])],
        "best": label(options[best]),
        "equal": [label(o) for o, c in zip(options, compared, strict=True) if c.verdict == "equal"],
        "equal_places": EQUAL_PLACES,
        "narrow_places": NARROW_PLACES,
        "simultaneous": [list(c.simultaneous) for c in compared],
        "positions": [list(c.positions) for c in compared],
        "finished": [c.finished for c in compared],
        "stops": [c.stops for c in compared],
    }
