"""The strongest check of a counterfactual: the race driven on toward it, all that is hidden drawn anew, and how often the call is made.

Laps that are still to come are driven from the moment on, gaps moved now by what they are to be off then. A change that is to hold at
once is put in some laps before the decision, and the race driven back up to it. Noise, rivals and their stops do what they do.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.environment import RaceEnvironment
from rsrl.explanation.counterfactual.change import CAUSE, CAUSES, HYPOTHETICAL, RaceEditor
from rsrl.explanation.counterfactual.query import PolicyQuery
from rsrl.explanation.moment import Arrays, Moment
from rsrl.rollouts import belief_of
from rsrl.rollouts.futures import draw_future
from rsrl.simulator import layout as at
from rsrl.simulator import random as rng
from rsrl.simulator.race import advance_batch
from rsrl.state import COLUMN, RAW_SIZE

Floats = NDArray[np.float32]
RUNS: Final = 200
LAPS_BEFORE: Final = 3
FUTURES: Final = 0xC0F
"""Sets these runs apart from every race."""
GAPS: Final = (CAUSE["gap_ahead_s"], CAUSE["gap_behind_s"])
LATER, CALLED = CAUSE["laps_later"], CAUSE["laps_called"]
PAST: Final = [CAUSE[name] for name in HYPOTHETICAL]


@dataclass(frozen=True)
class Share:
    """In how many of so many runs the call was made, over how many laps each."""

    share: float
    runs: int
    laps: int

    @property
    def standard_error(self) -> float:
        """Of the share."""
        return float(np.sqrt(self.share * (1.0 - self.share) / self.runs))


def simulated_share(
    asker: PolicyQuery, row: Floats, starts: NDArray[np.float64], target: int, *, seed: int = 0, runs: int = RUNS
) -> Share | None:
    """Share of runs in which the policy makes the call `target` at the changed decision, or before it where laps are still to come.

    None where there is nothing to drive: the change holds at once, and the laps before cannot be driven again, as in the first lap of a
    stint or a state from elsewhere.
    """
    moment = asker.moment
    later = int(np.nan_to_num(row[[LATER, CALLED]]).max())
    start = moment if later else _laps_before(moment)
    if start is None:
        return None
    laps = later or moment.lap - start.lap
    states = _shifted(asker, start, row, starts, seed, runs)
    calls = None if later else moment.calls[len(moment.calls) - laps :]
    made = _drive(asker, start, states, laps, calls, row, target)
    return Share(float(made.mean()), runs, laps)


def _laps_before(moment: Moment) -> Moment | None:
    """The same race some laps earlier in the stint; None where it cannot be driven again."""
    stops = moment.raw[:, COLUMN["stops_made"]]
    laps = min(LAPS_BEFORE, len(stops) - 1 - int(np.flatnonzero(stops == stops[-1])[0]))
    if moment.seed is None or moment.race is None or laps < 1:
        return None
    environment = RaceEnvironment(moment.record, moment.car)
    environment.reset(moment.seed, np.array([moment.race], np.int64))
    for call in moment.calls[: len(moment.calls) - laps]:
        environment.step(np.array([call], np.int8))
    b = environment.races
    if not np.array_equal(environment.raw[0], moment.raw[-1 - laps], equal_nan=True):
        return None  # the moment was not driven in a race of this kind
    return Moment(
        moment.record, moment.car, moment.lap - laps, moment.raw[:-laps], environment.legal[0].copy(), moment.calls[:-laps],
        (b.f[0].copy(), b.k[0].copy(), b.r[0].copy()), moment.seed, moment.race,
    )  # fmt: skip


def _shifted(asker: PolicyQuery, start: Moment, row: Floats, starts: NDArray[np.float64], seed: int, runs: int) -> Arrays:
    """Races as they stand at the start with the gaps moved, hidden things drawn anew: f [runs, ...], k, r."""
    first = np.full((1, len(CAUSES)), np.nan, np.float32)
    first[0, PAST] = row[PAST]
    for cause in GAPS:
        if not np.isnan(row[cause]):
            gap = start.raw[-1, COLUMN[CAUSES[cause]]]
            first[0, cause] = max(gap + row[cause] - np.float32(starts[cause]), 0.0)
    alterer = RaceEditor(start.record, start.car, start.arrays, asker.alterer.observer)
    _, one = alterer.states(first)
    f, k, r = np.repeat(one[0], runs, axis=0), np.repeat(one[1], runs, axis=0), np.repeat(one[2], runs, axis=0)
    figures = asker.alterer.observer.figures
    draw_futures(figures, figures.rival_plans, belief_of(figures, start.arrays[0]), f, k, r, start.car, np.uint64(seed ^ FUTURES))
    return f, k, r


def _drive(
    asker: PolicyQuery, start: Moment, states: Arrays, laps: int, calls: NDArray[np.int8] | None, row: Floats, target: int
) -> NDArray[np.bool_]:
    """Which runs make the call: at the last decision, where `calls` says what is called until then, else then at the latest.

    A car that is to wait stays out whatever the policy says; the first stop it calls for after the present lap counts, but one that
    it calls for now. A car that the policy calls until then is called by it in each run.
    """
    policy, figures = asker.policy, asker.alterer.observer.figures
    encoder, n = policy.encoder(start.record), len(states[0])
    raw, legal, actions = np.zeros((n, RAW_SIZE), np.float32), np.zeros((n, 4), np.bool_), np.zeros((n, at.CARS), np.int8)
    memory = policy.agent.initial_memory(n)
    for past in start.raw[:-1] if policy.recurrent else ():
        _, memory = policy.agent.q_values(encoder(np.repeat(past[None], n, axis=0)), memory)
    made, waits = np.zeros(n, np.bool_), np.ones(n, np.bool_)
    present = int(policy.chosen(policy.q(asker.moment)[None], asker.moment.legal[None])[0])
    last = np.full((1, len(CAUSES)), np.nan, np.float32)
    at_once = [i for i in range(len(CAUSES)) if i not in (*GAPS, LATER, CALLED, *PAST)]
    followed = not np.isnan(row[CALLED])
    for lap in range(laps + 1):
        if lap == laps:
            last[0, at_once] = row[at_once]
        _look(asker, start, states, last, raw, legal)
        q, memory = policy.agent.q_values(encoder(raw), memory)
        call = policy.chosen(q, legal)
        if lap == laps or (calls is None and lap > 0):
            made |= waits & (call == target)
            waits &= followed | (call == 0) | (call == present)
        if lap < laps:
            own = np.where(legal[np.arange(n), call], call, 0) if followed else 0
            actions[:, start.car] = own if calls is None else calls[lap]
            advance_batch(figures, figures.rival_plans, *states, actions)
            waits &= states[1][:, at.K_PLACE, start.car] < states[2][:, at.R_RUNNING]
    return made


def _look(asker: PolicyQuery, start: Moment, states: Arrays, change: Floats, raw: Floats, legal: NDArray[np.bool_]) -> None:
    """Raw rows and legal calls of the races, each with the same change put in."""
    for i in range(len(raw)):
        altered = RaceEditor(start.record, start.car, (states[0][i], states[1][i], states[2][i]), asker.alterer.observer)(change)
        raw[i], legal[i] = altered.raw[0], altered.legal[0] & altered.possible[0]


@kernel()
def draw_futures(fig, plans, belief, f, k, r, car, seed):
    """Draw anew what is hidden in each race of a batch, in place; lap times are followed, since the policy reads what they tell."""
    for i in range(f.shape[0]):
        key0, key1 = rng.race_keys(seed, i)
        draw_future(fig, plans, belief, f[i], k[i], r[i], car, car, key0, key1)
        r[i, at.R_WATCHED] = 1
