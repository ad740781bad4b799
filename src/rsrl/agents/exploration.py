"""How RSRL's learner tries things: random plans for whole stretches of a race, and small departures from its own policy.

Random actions lap by lap would ruin nearly every race before its end; a random plan of one to three stops is a race
somebody might drive. Everything random is drawn ahead as one function of (seed, iteration).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.networks import N_ACTIONS

MAX_STOPS = 3


@dataclass(frozen=True)
class Experiments:
    """The luck of one iteration's exploration; T laps, B races.

    Attributes:
        plan: actions of a random plan, int8 [T, B].
        plan_until: the plan is followed before this lap, int64 [B]; 0 in races without one.
        departure: uniform draws [T, B], against the chances of a departure.
        priority: which action is taken where one must be drawn: the legal one of highest priority, float32 [T, B, 4].
    """

    plan: NDArray[np.int8]
    plan_until: NDArray[np.int64]
    departure: NDArray[np.float32]
    priority: NDArray[np.float32]


def draw_experiments(rng: np.random.Generator, laps: int, races: int, plan_share: float) -> Experiments:
    """Draw for a batch of races; a share `plan_share` of them gets a random plan."""
    stops = rng.integers(1, MAX_STOPS + 1, races)
    # Three laps a race and a tyre for each; only the first `stops` of them count.
    stop_laps = rng.integers(0, laps, (MAX_STOPS, races))
    tyres = rng.integers(1, N_ACTIONS, (MAX_STOPS, races), dtype=np.int8)
    plan = np.zeros((laps, races), np.int8)
    columns = np.arange(races)
    for k in range(MAX_STOPS):
        counts = k < stops
        plan[stop_laps[k, counts], columns[counts]] = tyres[k, counts]
    until = np.where(rng.random(races) < plan_share, rng.integers(1, laps + 1, races), 0)
    departure = rng.random((laps, races), dtype=np.float32)
    return Experiments(plan, until, departure, rng.random((laps, races, N_ACTIONS), dtype=np.float32))


def explore(
    experiments: Experiments,
    lap: int,
    greedy: NDArray[np.int8],
    legal: NDArray[np.bool_],
    pit_chance: float,
    delay_chance: float,
) -> NDArray[np.int8]:
    """What to do on a lap (0 is the first), int8 [B]: the plan's action, a departure from `greedy`, or `greedy`.

    Always legal where anything is: an illegal stop becomes a legal one, or else the greedy action.
    """
    stop = drawn_stop(experiments.priority[lap], legal)
    departs = experiments.departure[lap] < np.where(greedy == 0, pit_chance, delay_chance)
    wanted = np.where(departs, np.where(greedy == 0, stop, 0), greedy)
    planned = lap < experiments.plan_until
    wanted = np.where(planned, experiments.plan[lap], wanted)
    rows = np.arange(greedy.size)
    wanted = np.where(~legal[rows, wanted] & (wanted > 0), stop, wanted)
    return np.where(legal[rows, wanted], wanted, greedy).astype(np.int8)


def drawn_stop(priority: NDArray[np.float32], legal: NDArray[np.bool_]) -> NDArray[np.int8]:
    """A random legal stop of each race, int8 [B]; 0 (stay out) where none is legal."""
    allowed = np.where(legal[:, 1:], priority[:, 1:], -1.0)
    best = allowed.argmax(axis=1)
    return np.where(allowed[np.arange(best.size), best] >= 0.0, best + 1, 0).astype(np.int8)
