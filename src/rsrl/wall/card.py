"""The card that is always ready: what to do if a safety car, a virtual one or a red flag comes on this lap, its worth, and until where it
holds."""

from typing import Final

import numpy as np

from rsrl.environment.kernels import write_legal
from rsrl.explanation import AnyPolicy, ExplainedPolicy, Moment
from rsrl.explanation.from_state import observed, reobserved, under_status
from rsrl.explanation.what_if.comparison import compare
from rsrl.explanation.what_if.continuation import Continuation
from rsrl.rollouts import STAY, FutureBatch, Option
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.simulator import layout as at
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.state import Observer
from rsrl.wall.messages import CALLS, STATUSES, CardEntry, Interval

FUTURES: Final = 200
HOLD_FUTURES: Final = 24
HOLD_LAPS: Final = 8
HOLDS: Final = 0.8
"""A call holds on a lap if the policy makes it in this share of the futures."""

VERDICTS: Final = {"better": "box", "worse": "stay out"}


def card(policy: AnyPolicy, moment: Moment, observer: Observer, seed: int) -> tuple[CardEntry, ...]:
    """Entries for VSC, safety car and red flag; none unless the coming lap is green, and before lap 2."""
    if moment.lap < 2 or moment.arrays[2][at.R_STATUS] != GREEN:
        return ()
    then = {status: _under(moment, status, observer) for status in (VSC, SC, RED)}
    calls = {status: policy.call(there) for status, there in then.items()}
    holds = _holds(policy, moment, observer, calls, seed)
    return tuple(_entry(policy, then[status], calls[status], holds[status], moment, seed) for status in then)


def _under(moment: Moment, status: int, observer: Observer) -> Moment:
    """The moment with the status just come out."""
    if status != RED:
        return under_status(moment, status, observer)
    r = moment.arrays[2].copy()
    r[at.R_STATUS], r[at.R_SINCE], r[at.R_RESTART], r[at.R_LEFT] = RED, 0, 0, 1
    return reobserved(moment, (*moment.arrays[:2], r), observer)


def _entry(policy: AnyPolicy, there: Moment, call: int, holds: int | None, moment: Moment, seed: int) -> CardEntry:
    status = int(there.arrays[2][at.R_STATUS])
    stops = [c for c in (1, 2, 3) if there.legal[c]]
    places, verdict = None, "only one call"
    if there.legal[0] and stops:
        stop = call or policy.preferred(there, stops)
        results = Continuation(policy, [there]).run((Option(0, stop), STAY), FUTURES, seed)
        found = compare(results, 1)[0]
        places = Interval(mean=round(found.places.mean, 3), low=round(found.places.low, 3), high=round(found.places.high, 3))
        verdict = VERDICTS.get(found.verdict, "no difference")
    looked = min(moment.lap + HOLD_LAPS, moment.record.laps - 1)
    return CardEntry(
        status=STATUSES[status],  # type: ignore[arg-type]  # never green
        call=CALLS[call],
        places=places,
        verdict=verdict,  # type: ignore[arg-type]
        holds_until=holds,
        looked_until=looked,
        double_stack_s=_double_stack_s(moment) if call else None,
    )


def _holds(policy: AnyPolicy, moment: Moment, observer: Observer, calls: dict[int, int], seed: int) -> dict[int, int | None]:
    """Last lap up to which each call holds as the car stays out, None where it holds as far as is looked; this lap for other policies."""
    if not isinstance(policy, ExplainedPolicy) or policy.recurrent:
        return dict.fromkeys(calls, moment.lap)
    held: dict[int, int | None] = dict.fromkeys(calls)
    futures = FutureBatch(observer.figures, moment.car, RaceArrays(*moment.arrays), HOLD_FUTURES, seed)
    encode = policy.encoder(moment.record)
    for lap in range(moment.lap + 1, min(moment.lap + HOLD_LAPS, moment.record.laps - 1) + 1):
        futures.advance(0)
        for status in [s for s in calls if held[s] is None]:
            rows, legal = [], []
            for f, k, r in zip(*futures.races, strict=True):
                if r[at.R_STATUS] != GREEN or k[at.K_PLACE, moment.car] >= r[at.R_RUNNING]:
                    continue
                there = r.copy()
                there[at.R_STATUS], there[at.R_SINCE], there[at.R_RESTART], there[at.R_LEFT] = status, 0, 0, 1
                may = np.zeros(4, np.bool_)
                write_legal(observer.figures.whole, k, there, moment.car, may)
                rows.append(observed((f, k, there), observer))
                legal.append(may)
            if not rows:
                continue
            made = policy.chosen(policy.q_of_rows(encode(np.stack(rows))), np.stack(legal))
            if (made == calls[status]).mean() < HOLDS:
                held[status] = lap - 1
    return held


def _double_stack_s(moment: Moment) -> float | None:
    """How long the car would wait behind its team's other car, ahead of it on the road, if both box; None where it would not."""
    record, (f, k, r) = moment.record, moment.arrays
    mates = [i for i, entry in enumerate(record.cars) if entry.team == record.cars[moment.car].team and i != moment.car]
    ahead = [i for i in mates if k[at.K_PLACE, i] < k[at.K_PLACE, moment.car] < r[at.R_RUNNING]]
    waits = [record.pit.stack_s.value - float(f[at.F_TIME, moment.car] - f[at.F_TIME, i]) for i in ahead]
    return round(max(waits), 1) if waits and max(waits) > 0 else None
