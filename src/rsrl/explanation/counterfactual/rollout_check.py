"""The strongest check of a counterfactual: rollouts toward it with all hidden state drawn anew, and how often the call is made.

A change some laps from now is rolled out from the moment, with gaps shifted now by what they are to differ then. A change that is to hold
at once is made some laps before the decision, and the race rolled out back up to it. Noise, rivals and their stops are random.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.explanation.counterfactual.change import CAUSES, CLOCKS, GAPS, PAST, RaceEditor, empty_rows
from rsrl.explanation.counterfactual.edit_kernels import CALLED
from rsrl.explanation.counterfactual.query import PolicyQuery
from rsrl.explanation.counterfactual.search import Counterfactual
from rsrl.explanation.moment import Moment
from rsrl.rollouts import FutureBatch
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.state import COLUMN, RAW_SIZE

Floats = NDArray[np.float32]
Bools = NDArray[np.bool_]
RUNS: Final = 200
MAX_LAPS_BEFORE: Final = 3
FUTURES: Final = 0xC0F
"""Keeps the random draws of these rollouts apart from those of every simulated race."""

AT_ONCE: Final = [i for i in range(len(CAUSES)) if i not in (*GAPS, *CLOCKS, *PAST)]
"""Causes that are made at the decision itself; gaps and the past are made where the rollouts start."""


@dataclass(frozen=True)
class RolloutShare:
    """In what share of `runs` rollouts of `laps` laps the policy makes the call."""

    share: float
    runs: int
    laps: int

    @property
    def standard_error(self) -> float:
        """Of the share."""
        return float(np.sqrt(self.share * (1.0 - self.share) / self.runs))


def rollout_share(query: PolicyQuery, found: Counterfactual, target: int, *, seed: int = 0, runs: int = RUNS) -> RolloutShare | None:
    """Share of rollouts in which the policy calls `target` at the changed decision, or before it where laps are still to come.

    None where the change holds at once and the laps before cannot be rolled out: in the first lap of a stint, or for a state that is not
    from a simulated race.
    """
    moment = query.moment
    later = found.change.laps
    start = moment if later else _laps_before(moment)
    if start is None:
        return None
    laps = later or moment.lap - start.lap
    futures = _shifted_futures(query, start, found, seed, runs)
    made = _calls_until(query, start, futures, found, target) if later else _calls_at_decision(query, start, futures, found, target)
    return RolloutShare(float(made.mean()), runs, laps)


def _laps_before(moment: Moment) -> Moment | None:
    """The same race some laps earlier in the stint; None where it cannot be simulated again."""
    stops = moment.raw[:, COLUMN["stops_made"]]
    laps = min(MAX_LAPS_BEFORE, len(stops) - 1 - int(np.flatnonzero(stops == stops[-1])[0]))
    if moment.seed is None or moment.race is None or laps < 1:
        return None
    environment = RaceEnvironment(moment.record, moment.car)
    environment.reset(moment.seed, np.array([moment.race], np.int64))
    for call in moment.calls[: len(moment.calls) - laps]:
        environment.step(np.array([call], np.int8))
    b = environment.races
    if not np.array_equal(environment.raw[0], moment.raw[-1 - laps], equal_nan=True):
        return None  # the moment comes from another kind of race, such as one whose rivals a policy calls
    return Moment(
        moment.record, moment.car, moment.lap - laps, moment.raw[:-laps], environment.legal[0].copy(), moment.calls[:-laps],
        (b.f[0].copy(), b.k[0].copy(), b.r[0].copy()), moment.seed, moment.race,
    )  # fmt: skip


def _shifted_futures(query: PolicyQuery, start: Moment, found: Counterfactual, seed: int, runs: int) -> FutureBatch:
    """Futures of the race at the start, its past as the change has it and gaps shifted by what they are to differ at the decision."""
    first = empty_rows(1)
    first[0, PAST] = found.row[PAST]
    for cause in GAPS:
        if not np.isnan(found.row[cause]):
            gap = start.raw[-1, COLUMN[CAUSES[cause]]]
            first[0, cause] = max(gap + found.row[cause] - np.float32(found.starts[cause]), 0.0)
    observer = query.editor.observer
    _, (f, k, r) = RaceEditor(start.record, start.car, start.arrays, observer).states(first)
    return FutureBatch(observer.figures, start.car, RaceArrays(f[0], k[0], r[0]), runs, seed ^ FUTURES)


class _PolicyInFutures:
    """The policy observing every future of a batch, one lap after the other, with its memory of the laps before."""

    def __init__(self, query: PolicyQuery, start: Moment, futures: FutureBatch) -> None:
        self._policy, self._observer, self._start, self._futures = query.policy, query.editor.observer, start, futures
        self._encoder = self._policy.encoder(start.record)
        self._memory = self._policy.agent.initial_memory(len(futures))
        for past in start.raw[:-1] if self._policy.recurrent else ():
            rows = self._encoder(np.repeat(past[None], len(futures), axis=0))
            _, self._memory = self._policy.agent.q_values(rows, self._memory)

    def calls(self, change: Floats) -> tuple[NDArray[np.int8], Bools]:
        """The policy's calls int8 [runs] with the same change [1, causes] made to every future, and the legal calls bool [runs, 4]."""
        runs, s = len(self._futures), self._futures.races
        raw, legal = np.zeros((runs, RAW_SIZE), np.float32), np.zeros((runs, 4), np.bool_)
        for i in range(runs):
            edited = RaceEditor(self._start.record, self._start.car, (s.f[i], s.k[i], s.r[i]), self._observer).edit(change)
            raw[i], legal[i] = edited.raw[0], edited.legal[0] & edited.feasible[0]
        q, self._memory = self._policy.agent.q_values(self._encoder(raw), self._memory)
        return self._policy.chosen(q, legal), legal


def _calls_at_decision(query: PolicyQuery, start: Moment, futures: FutureBatch, found: Counterfactual, target: int) -> Bools:
    """Whether the call is made at the decision, bool [runs], after the laps from the start to it under the calls made then."""
    policy = _PolicyInFutures(query, start, futures)
    for call in query.moment.calls[start.lap - 1 :]:
        policy.calls(empty_rows(1))
        futures.advance(call)
    return policy.calls(_made_at_decision(found))[0] == target


def _calls_until(query: PolicyQuery, start: Moment, futures: FutureBatch, found: Counterfactual, target: int) -> Bools:
    """Whether the call is made on one of the laps up to the changed decision, the present one left out, bool [runs].

    With `laps_called` the policy calls until then. Else the car stays out, and a future counts until the policy first calls a stop
    other than the one it calls now.
    """
    moment, policy, n = query.moment, _PolicyInFutures(query, start, futures), len(futures)
    present = int(query.policy.chosen(query.policy.q(moment)[None], moment.legal[None])[0])
    followed = not np.isnan(found.row[CALLED])
    made, waits = np.zeros(n, np.bool_), np.ones(n, np.bool_)
    for lap in range(found.change.laps + 1):
        last = lap == found.change.laps
        call, legal = policy.calls(_made_at_decision(found) if last else empty_rows(1))
        if lap > 0:
            made |= waits & (call == target)
            waits &= followed | (call == 0) | (call == present)
        if not last:
            futures.advance(np.where(legal[np.arange(n), call], call, 0).astype(np.int8) if followed else 0)
    return made


def _made_at_decision(found: Counterfactual) -> Floats:
    change = empty_rows(1)
    change[0, AT_ONCE] = found.row[AT_ONCE]
    return change
