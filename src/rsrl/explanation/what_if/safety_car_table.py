"""The table a pit wall prepares before the race: should a safety car come out on a lap, to box or not, and what it is worth."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.episodes import Driven, common_plan, drive
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.what_if.comparison import Estimate, estimate
from rsrl.explanation.what_if.continuation import Continuation
from rsrl.explanation.what_if.status import under_status
from rsrl.rollouts import O_POSITION, Option, Progress
from rsrl.season import COMPOUND_NAMES, COMPOUNDS, GREEN, SC, VSC, RaceRecord
from rsrl.simulator import layout as at
from rsrl.state import ACTION_NAMES, Observer

FIELD_RACES: Final = 200
"""Races called by the policy from which the states are taken."""

STATES: Final = 32
"""States of a lap and compound, at most."""

LEAST_SHARE: Final = 0.1
"""A compound is listed for a lap where at least so many of the races are on it."""

STATUS_NAMES: Final = {SC: "safety car", VSC: "virtual safety car"}


@dataclass(frozen=True)
class Row:
    """One line: a lap, a compound with its age, a status; the call, how many of the states call it, and what boxing changes."""

    lap: int
    compound: int
    age_laps: int
    on_plan: bool
    share: float
    status: int
    call: int
    agreed: float
    stop: int
    worth: Estimate
    futures: int


def safety_car_table(
    policy: ExplainedPolicy,
    record: RaceRecord,
    car: int,
    *,
    seed: int = 0,
    races: int = 320,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Explanation:
    """For every lap from the second on, each compound the car may be on by then, SC and VSC: the policy's call, and what boxing is worth.

    The states come from FIELD_RACES races called by the policy; a compound that at least LEAST_SHARE of them are on is listed. Of its
    states those are taken whose set is nearest to the age it has by the policy's commonest plan, or to the median. In each the status is
    set to a safety car just out; the call is that of most states. Then `races` futures, spread over the states, are run on under the best
    stop and under staying out, the policy following. `values` is the mean change in finishing position by boxing (below zero: boxing
    gains), its standard error by states.

    Raises:
        RsrlError: fewer than 2 races, a negative seed.
    """
    if races < 2 or seed < 0:
        raise RsrlError(f"safety-car table: races is {races}, seed {seed}; at least 2 races and a seed from 0")
    driven = drive(policy, record, car, FIELD_RACES, seed)
    plan, on = common_plan(driven)
    observer = Observer(record, car)
    rows: list[Row] = []
    laps = range(2, record.laps)
    for done, lap in enumerate(laps, 1):
        for compound, numbers in _groups(driven, lap):
            for status in (SC, VSC):
                rows += _row(policy, driven, lap, compound, numbers, status, on.get(lap), observer, races, seed, threads)
        if progress:
            progress(done, len(laps))
    return _explanation(policy, driven.moment(1, 0), rows, plan, seed, races)


def _groups(driven: Driven, lap: int) -> list[tuple[int, NDArray[np.int64]]]:
    """Compounds of a lap, each with the races on it that are green, the likeliest first."""
    i = lap - 1
    green = driven.going[i] & (driven.arrays[2][i, :, at.R_STATUS] == GREEN)
    fitted = driven.arrays[1][i, :, at.K_COMPOUND, driven.car]
    groups = [(c, np.flatnonzero(green & (fitted == c))) for c in range(len(COMPOUNDS))]
    kept = [(c, numbers) for c, numbers in groups if len(numbers) >= max(LEAST_SHARE * green.sum(), 2)]
    return sorted(kept, key=lambda group: -len(group[1]))


def _row(
    policy: ExplainedPolicy, driven: Driven, lap: int, compound: int, numbers: NDArray[np.int64], status: int,
    planned: tuple[int, int] | None, observer: Observer, races: int, seed: int, threads: int | None,
) -> list[Row]:  # fmt: skip
    """The line of one group; none where the car may not both stay and box."""
    i = lap - 1
    ages = driven.arrays[1][i, numbers, at.K_AGE, driven.car]
    on_plan = planned is not None and planned[0] == compound
    target = planned[1] if planned is not None and on_plan else float(np.median(ages))
    chosen = np.argsort(np.abs(ages - target), kind="stable")[:STATES]
    every = [under_status(driven.moment(lap, int(n)), status, observer) for n in numbers[chosen]]
    moments = [m for m in every if m.legal[0] and m.legal[1:].any()]
    if len(moments) < 2:
        return []
    calls, stops = _calls(policy, moments)
    call, stop = Counter(calls).most_common(1)[0][0], Counter(stops).most_common(1)[0][0]
    if call != 0:
        stop = call
    moments = [m for m in moments if m.legal[stop]]
    if len(moments) < 2:
        return []
    each = max(races // len(moments), 1)
    futures = each * len(moments)
    results = Continuation(policy, moments).run(
        (Option(0, stop), Option(0, 0)), futures, seed, first=futures * (2 * lap + (status == SC)), threads=threads
    )
    change = (results[:, 0] - results[:, 1])[:, O_POSITION]
    by_state = change.reshape(each, len(moments)).mean(axis=0)  # futures go on from the states in turn
    share = len(numbers) / max(int((driven.going[i] & (driven.arrays[2][i, :, at.R_STATUS] == GREEN)).sum()), 1)
    return [
        Row(
            lap=lap, compound=compound, age_laps=round(float(np.median(ages[chosen]))),
            on_plan=on_plan, share=share, status=status, call=call, agreed=calls.count(call) / len(calls), stop=stop,
            worth=estimate(by_state), futures=futures,
        )
    ]  # fmt: skip


def _calls(policy: ExplainedPolicy, moments: Sequence[Moment]) -> tuple[list[int], list[int]]:
    """The policy's call in each state, and its best stop."""
    q = np.stack([policy.q(m) for m in moments])
    legal = np.stack([m.legal for m in moments])
    stops = np.where(legal[:, 1:], q[:, 1:], -np.inf).argmax(axis=1) + 1
    return [int(c) for c in policy.chosen(q, legal)], [int(s) for s in stops]


def _explanation(policy: ExplainedPolicy, start: Moment, rows: Sequence[Row], plan: str, seed: int, races: int) -> Explanation:
    decision: Decision = policy.decide(start)
    return Explanation(
        method="safety-car table",
        decision=decision,
        question="what boxing under a safety car changes against staying out",
        unit="places",
        labels=tuple(_label(r) for r in rows),
        values=np.array([r.worth.mean for r in rows]),
        exact=False,
        budget=sum(2 * r.futures for r in rows),
        standard_errors=np.array([r.worth.se for r in rows]),
        columns={
            "lap": [r.lap for r in rows],
            "compound": [COMPOUNDS[r.compound] for r in rows],
            "tyre_age_laps": [r.age_laps for r in rows],
            "on_plan": [r.on_plan for r in rows],
            "share_of_races": [r.share for r in rows],
            "track_status": [STATUS_NAMES[r.status] for r in rows],
            "call": [ACTION_NAMES[r.call] for r in rows],
            "share_calling_it": [r.agreed for r in rows],
            "stop_tried": [ACTION_NAMES[r.stop] for r in rows],
            "low": [r.worth.low for r in rows],
            "high": [r.worth.high for r in rows],
        },
        details={"plan": plan, "seed": seed, "futures_a_row": races, "field_races": FIELD_RACES},
        sentences=_sentences(rows, plan, start),
    )


def _label(r: Row) -> str:
    age = f"{r.age_laps} lap{'' if r.age_laps == 1 else 's'}"
    return f"lap {r.lap}, {COMPOUND_NAMES[r.compound]} {age} old, {STATUS_NAMES[r.status]}"


def _sentences(rows: Sequence[Row], plan: str, start: Moment) -> tuple[str, ...]:
    """The plan, and on which laps of it the policy boxes."""
    lines = [f"{start.driver} at {start.record.name}: the policy mostly drives {plan}."] if plan else []
    for status in (SC, VSC):
        boxes = sorted({r.lap for r in rows if r.status == status and r.on_plan and r.call > 0})
        where = f"on lap{'s' if len(boxes) > 1 else ''} {', '.join(_runs(boxes))}" if boxes else "on no lap"
        lines.append(f"Under a {STATUS_NAMES[status]} it would box {where} of that plan.")
    return tuple(lines)


def _runs(laps: Sequence[int]) -> list[str]:
    """Laps in order, neighbours joined: 3-7, 12."""
    runs: list[list[int]] = []
    for lap in laps:
        if runs and lap == runs[-1][-1] + 1:
            runs[-1].append(lap)
        else:
            runs.append([lap])
    return [f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs]
