"""Races a policy calls, with what it thought of each call and what came of it; and decisions drawn from them to be explained."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.explanation.attribution.values import single_blas_thread
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord

FIDELITY_SEED: Final = 702_113
"""Names the races explained. No evaluation, training or background uses it."""


@dataclass(frozen=True)
class DrivenRaces:
    """Races called by the policy.

    Attributes:
        moments: one decision of each race on a lap drawn at random, and one stop of each race that has any; more than one call is legal.
        running: bool [R, L], the lap was driven.
        q: float32 [R, L], value of the call made.
        outcome: float64 [R, L], what came of it, in the unit of the values: minus the finishing position for RSRL's own policies, for
            others the rewards from that lap on, discounted as in training.
    """

    moments: tuple[Moment, ...]
    running: NDArray[np.bool_]
    q: NDArray[np.float32]
    outcome: NDArray[np.float64]


def drive_and_draw(policy: ExplainedPolicy, record: RaceRecord, car: int, races: int, seed: int) -> DrivenRaces:
    """Let the policy call races 0 to races - 1 of `seed` and draw decisions from them."""
    with single_blas_thread():
        return _drive(policy, record, car, races, seed)


def _drive(policy: ExplainedPolicy, record: RaceRecord, car: int, races: int, seed: int) -> DrivenRaces:
    rng = np.random.default_rng(seed)
    wanted = (rng.random(races) * record.laps).astype(np.int64)
    environment, encode, every = RaceEnvironment(record, car, batch=races), policy.encoder(record), np.arange(races)
    environment.reset(seed, every)
    memory = policy.agent.initial_memory(races)
    shape = (races, record.laps)
    running, q, rewards = np.zeros(shape, np.bool_), np.zeros(shape, np.float32), np.zeros(shape, np.float64)
    raw, calls = np.zeros((races, record.laps, environment.raw.shape[1]), np.float32), np.zeros((races, record.laps), np.int8)
    at_random: dict[int, Moment] = {}
    stops: dict[int, list[Moment]] = {}
    for lap in range(record.laps):
        raw[:, lap], running[:, lap], legal = environment.raw, ~environment.done, environment.legal.copy()
        values, memory = policy.agent.q_values(encode(environment.raw), memory)
        call = policy.chosen(values, legal)
        calls[:, lap] = call
        q[:, lap] = values[every, calls[:, lap]]
        for race in np.flatnonzero(running[:, lap] & (legal.sum(axis=1) > 1) & ((wanted == lap) | (calls[:, lap] > 0))).tolist():
            arrays = (environment.races.f[race].copy(), environment.races.k[race].copy(), environment.races.r[race].copy())
            moment = Moment(record, car, lap + 1, raw[race, : lap + 1], legal[race], calls[race, :lap], arrays, seed, race)
            if wanted[race] == lap:
                at_random[race] = moment
            if calls[race, lap]:
                stops.setdefault(race, []).append(moment)
        rewards[:, lap] = environment.step(call).reward
    drawn = [among[rng.integers(len(among))] for among in stops.values()]
    outcome = _outcome(policy, environment, rewards)
    return DrivenRaces((*at_random.values(), *drawn), running, q, outcome)


def _outcome(policy: ExplainedPolicy, environment: RaceEnvironment, rewards: NDArray[np.float64]) -> NDArray[np.float64]:
    if policy.agent.kind == "rsrl":
        return np.repeat(-environment.outcome().position.astype(np.float64)[:, None], rewards.shape[1], axis=1)
    outcome, gamma = np.zeros_like(rewards), float(policy.about.config["gamma"])
    following = np.zeros(len(rewards))
    for lap in reversed(range(rewards.shape[1])):
        outcome[:, lap] = following = rewards[:, lap] + gamma * following
    return outcome
