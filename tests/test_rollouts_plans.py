"""Rollouts of plans: the race itself where nothing is random, and futures that agree with what is seen."""

import numpy as np
import pytest
from reactive_race import reactive
from synthetic_race import quiet, synthetic_race

from rsrl.rollouts import (
    B_PACE_SD,
    B_STINT_SD,
    BY_COST,
    PLAN_POSITION,
    PLAN_SMOOTH_POSITION,
    PLAN_TIME,
    CostToGo,
    prior_belief,
    roll_out_plans,
)
from rsrl.rollouts.futures import draw_future
from rsrl.season import SC, RaceRecord
from rsrl.simulator import Figures, Plan, RaceBatch, compile_figures, simulate
from rsrl.simulator import layout as at
from rsrl.simulator.plans import plan_table
from rsrl.simulator.random import race_keys

CAR = 7
State = tuple[np.ndarray, np.ndarray, np.ndarray]


def state_after(record: RaceRecord, laps: int, race: int = 0, plans: dict[int, Plan] | None = None) -> tuple[Figures, State]:
    """A race after some laps, car CAR called from outside and staying out, unless it has a plan."""
    figures = compile_figures(record)
    batch = RaceBatch(figures, 1, outside=() if plans and CAR in plans else (CAR,), plans=plans)
    batch.start(3, np.array([race], np.int64))
    for _ in range(laps):
        batch.advance()
    return figures, (batch.f[0], batch.k[0], batch.r[0])


def never_stops(figures: Figures) -> CostToGo:
    """Tables by which a car never stops again."""
    laps = int(figures.whole[at.I_LAPS])
    value, new = np.zeros((laps + 1, 2, 3, laps + 1, 1), np.float32), np.full((laps + 1, 2, 3, 1), 1e6, np.float32)
    return CostToGo(value, new, np.zeros(4, np.float32), np.zeros(2, np.float32))


def by_cost(*stops: tuple[int, int]) -> np.ndarray:
    """A plan row that stays out, or makes these (lap, compound) stops, and goes on by the cost to go."""
    row = np.zeros((1, at.P_COLUMNS), np.int32)
    row[0, at.P_STOPS], row[0, at.P_SC_WINDOW] = len(stops), BY_COST
    for i, (lap, compound) in enumerate(stops):
        row[0, at.P_FIRST + 2 * i : at.P_FIRST + 2 * i + 2] = lap, compound
    return row


def scrambled(state: State, record: RaceRecord) -> State:
    """The state with everything hidden replaced by nonsense."""
    f, k, r = (part.copy() for part in state)
    rng = np.random.default_rng(5)
    f[[at.F_PACE, at.F_OFFSET, at.F_USE, at.F_RAW]] = rng.normal(0, 3, (4, at.CARS))
    for row in (at.K_RETIRE, at.K_PLAN, at.K_NEXT, at.K_POINTER, at.K_WANT, at.K_BITS, at.K_BOX, at.K_AGE_CELL, at.K_FLAG_CELL):
        k[row] = rng.integers(0, record.laps, at.CARS)
    for i in (at.R_KEY0, at.R_KEY1, at.R_RETIREMENT, at.R_LEFT):
        r[i] = rng.integers(1, 1000)
    return f, k, r


def test_where_nothing_is_random_a_rollout_is_the_race() -> None:
    record = synthetic_race(plans=("S-H@6",), **quiet(pass_scale_s=0.0))
    rest = Plan((0, 2, 1), (7, 11))
    whole = simulate(record, 1, 3, plans={CAR: rest})
    for done in (0, 4, 9):
        figures, state = state_after(record, done, plans={CAR: rest})
        left = [i for i, lap in enumerate(rest.laps) if lap > done]
        row = plan_table([Plan((0, *(rest.compounds[1 + i] for i in left)), tuple(rest.laps[i] for i in left))])
        out = roll_out_plans(figures, row, never_stops(figures), prior_belief(figures), state, CAR, seed=1, futures=3)
        assert (out[:, 0, PLAN_POSITION] == whole.positions[0, CAR]).all()
        np.testing.assert_allclose(out[:, 0, PLAN_TIME], whole.race_time_s[0, CAR], atol=2e-3)
        stops = [(lap, c) for lap, c in zip(rest.laps, rest.compounds[1:], strict=True) if lap > done]
        same = roll_out_plans(figures, by_cost(*stops), never_stops(figures), prior_belief(figures), state, CAR, seed=1, futures=3)
        np.testing.assert_array_equal(same, out)


@pytest.mark.parametrize("reacting", [False, True])
def test_nothing_hidden_enters_and_the_state_is_left_alone(reacting: bool) -> None:
    record = reactive(synthetic_race(), 0.1) if reacting else synthetic_race()
    rows = np.concatenate([plan_table([Plan((0, 2), (9,), 4, 4)]), by_cost((10, 1)), by_cost()])
    for done in (0, 5, 12):
        figures, state = state_after(record, done, race=done)
        before = [part.copy() for part in state]
        belief, costs = prior_belief(figures), never_stops(figures)
        out = roll_out_plans(figures, rows, costs, belief, state, CAR, seed=8, futures=20)
        np.testing.assert_array_equal(out, roll_out_plans(figures, rows, costs, belief, scrambled(state, record), CAR, seed=8, futures=20))
        for part, kept in zip(state, before, strict=True):
            np.testing.assert_array_equal(part, kept)


def test_a_future_is_named_by_seed_and_number_and_shared_by_all_plans() -> None:
    figures, state = state_after(synthetic_race(), 4)
    rows = np.concatenate([plan_table([Plan((0, 2), (9,))]), by_cost((8, 1)), plan_table([Plan((0, 2), (9,))])])
    belief, costs = prior_belief(figures), never_stops(figures)
    whole = roll_out_plans(figures, rows, costs, belief, state, CAR, seed=8, futures=30)
    np.testing.assert_array_equal(whole[:, 0], whole[:, 2])
    part = roll_out_plans(figures, rows[1:2], costs, belief, state, CAR, seed=8, first=10, futures=5)
    np.testing.assert_array_equal(part[:, 0], whole[10:15, 1])
    assert not np.array_equal(whole[:, 0], roll_out_plans(figures, rows[:1], costs, belief, state, CAR, seed=9, futures=30)[:, 0])


def test_futures_spread_as_fresh_races_do() -> None:
    """From the grid, where nothing is known yet, a plan is worth what the engine says."""
    record = synthetic_race(plans=("S-H@6", "S-M@9"))
    plan = Plan((0, 2), (8,), 3, 3)
    fresh = simulate(record, 6000, 11, plans={CAR: plan}).positions[:, CAR]
    figures, state = state_after(record, 0)
    out = roll_out_plans(figures, plan_table([plan]), never_stops(figures), prior_belief(figures), state, CAR, seed=4, futures=6000)[:, 0]
    assert abs(out[:, PLAN_POSITION].mean() - fresh.mean()) < 4 * fresh.std() / 6000**0.5 * 2**0.5
    assert abs(out[:, PLAN_SMOOTH_POSITION].mean() - fresh.mean()) < 0.25
    np.testing.assert_allclose(
        np.bincount(out[:, PLAN_POSITION].astype(int), minlength=21) / 6000, np.bincount(fresh, minlength=21) / 6000, atol=0.03
    )
    spared = roll_out_plans(
        figures, plan_table([plan]), never_stops(figures), prior_belief(figures), state, CAR, seed=4, futures=2000, spared=CAR
    )
    assert spared[:, 0, PLAN_POSITION].mean() < out[:, PLAN_POSITION].mean() - 0.3, "without retirements it finishes further ahead"


def drawn(figures: Figures, state: State, number: int, belief: np.ndarray) -> State:
    f, k, r = (part.copy() for part in state)
    draw_future(figures, figures.rival_plans, belief, f, k, r, CAR, CAR, *race_keys(np.uint64(3), number))
    return f, k, r


def test_hidden_parts_are_drawn_from_what_is_known() -> None:
    figures, state = state_after(synthetic_race(stint_sd_s=0.4), 7, race=1)
    belief = prior_belief(figures)
    futures = [drawn(figures, state, i, belief) for i in range(400)]
    running = state[1][at.K_PLACE] < state[2][at.R_RUNNING]
    assert running[CAR]
    pace = np.array([f[at.F_PACE] for f, _, _ in futures])[:, running] - figures.cars[at.C_PACE][running]
    assert abs(pace.std() / belief[B_PACE_SD, 0] - 1) < 0.05
    luck = np.array([f[at.F_OFFSET] - figures.tyres[k[at.K_COMPOUND], at.Y_OFFSET] for f, k, _ in futures])[:, running]
    assert abs(luck.std() / belief[B_STINT_SD, 0] - 1) < 0.05
    for _, k, r in futures:
        assert (k[at.K_RETIRE][running] > 7).all()
        assert r[at.R_RETIREMENT] == k[at.K_RETIRE][running].min()
        assert k[at.K_RETIRE, CAR] == at.NO_STOP
        for car in np.flatnonzero(running):
            if car != CAR and (row := k[at.K_PLAN, car]) >= 0:
                plan = figures.rival_plans[row]
                made = k[at.K_STOPS, car]
                compounds = [plan[at.P_START], *plan[at.P_FIRST + 1 : at.P_FIRST + 2 * made : 2]]
                assert compounds[-1] == k[at.K_COMPOUND, car]
                assert k[at.K_NEXT, car] > 7
    unsure = [drawn(figures, state, i, belief)[1][at.K_PLAN] for i in range(100)]
    assert len({rows.tobytes() for rows in unsure}) > 20, "plans that agree are drawn among"


def test_a_safety_car_stays_out_as_long_as_it_may_after_what_it_has_done() -> None:
    figures, state = state_after(synthetic_race(sc_laps=(0.2, 0.3, 0.3, 0.2)), 5)
    state[2][at.R_STATUS], state[2][at.R_SINCE] = SC, 1
    left = np.array([drawn(figures, state, i, prior_belief(figures))[2][at.R_LEFT] for i in range(3000)])
    np.testing.assert_allclose(np.bincount(left, minlength=4)[1:] / 3000, [0.3 / 0.8, 0.3 / 0.8, 0.2 / 0.8], atol=0.03)
    state[2][at.R_SINCE] = 3
    assert {drawn(figures, state, i, prior_belief(figures))[2][at.R_LEFT] for i in range(50)} == {1}


def test_a_car_that_is_out_has_no_intent_in_a_future() -> None:
    """Its plan's row and pointer, nonsense here, would be read by the kernel that decides who boxes."""
    record = synthetic_race(retire_per_lap=0.05)
    figures, state = state_after(record, 9)
    _, k, r = drawn(figures, scrambled(state, record), 0, prior_belief(figures))
    out = state[1][at.K_PLACE] >= state[2][at.R_RUNNING]
    assert out.any()
    assert (k[at.K_PLAN][out] == -1).all()
    assert (k[at.K_NEXT][out] == at.NO_STOP).all()
    assert r[at.R_RUNNING] == (~out).sum()
