"""The table a pit wall prepares before the race: box or stay out if a safety car comes out on a lap, and what boxing is worth."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.explanation.episodes import EpisodeRecorder, Episodes
from rsrl.explanation.from_state import under_status
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.what_if.comparison import Estimate, estimate
from rsrl.explanation.what_if.continuation import Continuation
from rsrl.rollouts import O_POSITION, Option, Progress
from rsrl.season import COMPOUND_NAMES, COMPOUNDS, GREEN, SC, VSC, RaceRecord
from rsrl.state import ACTION_NAMES, COLUMN, Observer

FIELD_RACES: Final = 200
"""Races called by the policy from which the states are taken."""

STATES: Final = 32
"""Most states of a lap and compound."""

LEAST_SHARE: Final = 0.1
"""A compound is listed for a lap if at least this share of the races is on it."""

STATUS_NAMES: Final = {SC: "safety car", VSC: "virtual safety car"}


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        lap, compound, age_laps, status: the situation; on_plan: the compound is that of the policy's commonest plan.
        share: of the green races on that lap, how many are on the compound.
        call, agreed: the commonest call over the states, and the share of states with that call.
        stop: the stop compared with staying out; worth: its change in finishing position, over `futures` futures.
    """

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
    """The policy's call, and what boxing is worth, if a safety car or a virtual one comes out: for every lap from the second on.

    FIELD_RACES races called by the policy give the states. A row is made for each compound that at least LEAST_SHARE of them are on, from
    the STATES states whose tyre age is nearest to that of the policy's commonest plan (for a compound off the plan, to the median). In each
    the status is set to a safety car just out. The call is that of most states. Then `races` futures, spread over the states, are rolled
    out under the best stop and under staying out, the policy calling afterwards. `values` is the mean change in finishing position by
    boxing (below zero: boxing gains places), with a standard error over states.

    Raises:
        RsrlError: fewer than 2 races, a negative seed.
    """
    if races < 2 or seed < 0:
        raise RsrlError(f"safety-car table: races is {races}, seed {seed}; at least 2 races and a seed from 0")
    episodes = EpisodeRecorder(record, car, FIELD_RACES, policy, states=True).record(seed)
    plan, on = _common_plan(episodes)
    maker = _Rows(policy, episodes, races, seed, threads)
    rows: list[Row] = []
    laps = range(2, record.laps)
    for done, lap in enumerate(laps, 1):
        rows += maker.of_lap(lap, on.get(lap))
        if progress:
            progress(done, len(laps))
    return _explanation(policy, episodes.moment(1), rows, plan, seed, races)


def _common_plan(episodes: Episodes) -> tuple[str, dict[int, tuple[int, int]]]:
    """The commonest order of compounds among the races that reach the last lap.

    Returns:
        The plan as text, such as `S-H@14-S@36`, each stop on its median lap; and by lap the compound with its age in laps.
    """
    stops_made, fitted = episodes.raw[:, :, COLUMN["stops_made"]], episodes.raw[:, :, COLUMN["tyre"]].astype(int)
    paths = Counter[tuple[int, ...]]()
    stops: dict[tuple[int, ...], list[list[int]]] = {}
    for race in np.flatnonzero(episodes.running[-1]):
        laps = [int(i) for i in np.flatnonzero(np.diff(stops_made[:, race]) > 0) + 1]
        path = (int(fitted[0, race]), *(int(fitted[lap, race]) for lap in laps))
        paths[path] += 1
        stops.setdefault(path, []).append(laps)
    if not paths:
        return "", {}
    path = max(paths, key=lambda p: (paths[p], p))
    laps = [round(float(np.median(column))) for column in zip(*stops[path], strict=True)]
    text = "".join(f"-{COMPOUNDS[c]}@{lap}" for c, lap in zip(path[1:], laps, strict=True))
    edges = [0, *laps, episodes.record.laps]
    on = {lap: (c, lap - 1 - a) for c, a, b in zip(path, edges, edges[1:], strict=False) for lap in range(a + 1, b + 1)}
    return COMPOUNDS[path[0]] + text, on


class _Rows:
    """Makes the rows of the table from recorded races."""

    def __init__(self, policy: ExplainedPolicy, episodes: Episodes, races: int, seed: int, threads: int | None) -> None:
        self.policy, self.episodes, self.races, self.seed, self.threads = policy, episodes, races, seed, threads
        self._observer = Observer(episodes.record, episodes.car)

    def of_lap(self, lap: int, planned: tuple[int, int] | None) -> list[Row]:
        """Rows of a lap, the likeliest compound first; `planned` is the plan's compound and its age."""
        episodes, i = self.episodes, lap - 1
        green = episodes.running[i] & (episodes.raw[i, :, COLUMN["safety_car"]] == GREEN)
        fitted = episodes.raw[i, :, COLUMN["tyre"]]
        groups = [(c, np.flatnonzero(green & (fitted == c))) for c in range(len(COMPOUNDS))]
        kept = [(c, races) for c, races in groups if len(races) >= max(LEAST_SHARE * green.sum(), 2)]
        rows = []
        for compound, races in sorted(kept, key=lambda group: -len(group[1])):
            on_plan = planned is not None and planned[0] == compound
            ages = episodes.raw[i, races, COLUMN["tyre_age_laps"]]
            target = planned[1] if planned is not None and on_plan else float(np.median(ages))
            nearest = np.argsort(np.abs(ages - target), kind="stable")[:STATES]
            age, share = round(float(np.median(ages[nearest]))), len(races) / int(green.sum())
            for status in (SC, VSC):
                compared = self._compared(lap, races[nearest], status)
                rows += [Row(lap, compound, age, on_plan, share, status, *compared)] if compared else []
        return rows

    def _compared(self, lap: int, races: NDArray[np.int64], status: int) -> tuple[int, float, int, Estimate, int] | None:
        """Call, share of states with it, stop, its worth and the futures; None where staying out or every stop is not legal."""
        every = [under_status(self.episodes.moment(lap, int(race)), status, self._observer) for race in races]
        moments = [m for m in every if m.legal[0] and m.legal[1:].any()]
        if len(moments) < 2:
            return None
        calls, stops = _calls(self.policy, moments)
        call, stop = Counter(calls).most_common(1)[0][0], Counter(stops).most_common(1)[0][0]
        stop = call or stop
        moments = [m for m in moments if m.legal[stop]]
        if len(moments) < 2:
            return None
        each = max(self.races // len(moments), 1)
        futures = each * len(moments)
        results = Continuation(self.policy, moments).run(
            (Option(0, stop), Option(0, 0)), futures, self.seed, first=futures * (2 * lap + (status == SC)), threads=self.threads
        )
        change = (results[:, 0] - results[:, 1])[:, O_POSITION]
        by_state = change.reshape(each, len(moments)).mean(axis=0)  # future i starts from state i modulo the number of states
        return call, calls.count(call) / len(calls), stop, estimate(by_state), futures


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
        question="change in finishing position by boxing under a safety car, against staying out",
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
    lines = [f"{start.driver} at {start.record.name}: the policy's most common plan is {plan}."] if plan else []
    for status in (SC, VSC):
        boxes = sorted({r.lap for r in rows if r.status == status and r.on_plan and r.call > 0})
        where = f"on lap{'s' if len(boxes) > 1 else ''} {', '.join(_runs(boxes))}" if boxes else "on no lap"
        lines.append(f"If a {STATUS_NAMES[status]} comes out while the car is on that plan, the policy boxes {where}.")
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
