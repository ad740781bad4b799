"""Rollouts under a policy: what it reads in a future is what the race itself would show, whoever rolls it out."""

import numpy as np
import pytest
from synthetic_race import quiet, synthetic_race

from rsrl.agents.networks import Duelling
from rsrl.environment import FieldObserver, RaceEnvironment
from rsrl.rollouts import FutureBatch, Option, OptionRollouts, PolicyRollouts, belief_of, compiled_network, policy_inputs
from rsrl.rollouts.futures import draw_future
from rsrl.rollouts.hashing import stream_seed
from rsrl.season import RaceRecord
from rsrl.simulator import RaceBatch, compile_figures
from rsrl.simulator import layout as at
from rsrl.simulator.race_arrays import RaceArrays
from rsrl.simulator.random import race_keys
from rsrl.state import COLUMN, RAW_SIZE, Encoder, Observer, input_names

CAR, HARD, SEED = 9, 3, 5
CHEAP = synthetic_race(laps=20, stint_sd_s=0.3, loss_green_s=0.3, loss_vsc_s=0.3, loss_sc_s=0.3, plans=("S-M@12", "M-S@10"))
"""A race in which sets differ much, and a stop costs so little that the network is asked on every lap."""


def rollouts(record: RaceRecord, against_stops: float) -> PolicyRollouts:
    """A network that prefers staying out to any stop by so much on every lap."""
    network = Duelling(len(input_names("full")), 4)
    params = network.init(np.random.default_rng(0))
    params["q.bias"] = np.array([0.0, *[-against_stops] * 3], np.float32)
    observer = Observer(record, CAR)
    return PolicyRollouts(observer.figures, CAR, compiled_network(params), observer.context, Encoder("full", record.scaling))


def state_after(record: RaceRecord, laps: int) -> RaceArrays:
    """A race after some laps on which CAR stayed out."""
    environment = RaceEnvironment(record, CAR)
    environment.reset(1, np.array([0], np.int64))
    for _ in range(laps):
        environment.step(np.zeros(1, np.int8))
    assert not environment.done[0]
    b = environment.races
    return RaceArrays(b.f[0], b.k[0], b.r[0])


def driven_as_a_race(record: RaceRecord, state: RaceArrays, number: int, spared: int, seed: int = SEED) -> tuple[np.ndarray, RaceBatch]:
    """A future in which CAR boxes for the hard on the first lap, driven as any race is: raw rows [laps + 1, RAW_SIZE], and its end."""
    figures = compile_figures(record)
    batch, field = RaceBatch(figures, 1, outside=(CAR,)), FieldObserver(record, (CAR,), 1)
    batch.f[0], batch.k[0], batch.r[0] = state
    belief = belief_of(figures, state.f)
    draw_future(figures, batch.table, belief, batch.f[0], batch.k[0], batch.r[0], CAR, spared, *race_keys(np.uint64(seed), number))
    batch.r[0, at.R_WATCHED] = 1  # as in every race that has a car called from outside
    batch.actions[0, CAR] = HARD
    rows = np.full((record.laps + 1, RAW_SIZE), np.nan, np.float32)
    while not batch.r[0, at.R_FLAGGED]:
        batch.advance()
        batch.actions[0, CAR] = 0
        field.observe(batch)
        rows[batch.r[0, at.R_LAP]] = field.raw[0, 0]
    return rows, batch


@pytest.mark.parametrize("done", [4, 9, 13])
def test_after_a_stop_the_policy_reads_what_laps_show_of_the_new_set(done: int) -> None:
    state, lucks = state_after(CHEAP, done), []
    before, never_boxes = state.f[at.F_LUCK, CAR], rollouts(CHEAP, 9.0)
    assert abs(before) > 0.01, "the former set has shown its luck"
    for number in range(8):
        never_boxes.run(state, belief_of(compile_figures(CHEAP), state.f), np.array([HARD]), seed=SEED, first=number, futures=1)
        read = never_boxes._memory.decision.raw  # of the last decision, on the lap before the last
        lap = CHEAP.laps - int(read[COLUMN["laps_left"]])
        assert lap >= CHEAP.laps - 2
        np.testing.assert_array_equal(read, driven_as_a_race(CHEAP, state, number, CAR)[0][lap])
        assert read[COLUMN["stops_made"]] == 1
        lucks.append(read[COLUMN["set_luck_s"]])
    assert len(set(lucks)) == 8, "each future's set shows a luck of its own"
    assert before not in lucks


def test_options_are_read_as_the_race_shows_them_too() -> None:
    state, read = state_after(CHEAP, 9), []
    observer, encoder = Observer(CHEAP, CAR), Encoder("full", CHEAP.scaling)

    def never_boxes(x: np.ndarray, legal: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        read.append(x[0].copy())
        return np.zeros(len(x), np.int8), memory

    races = RaceArrays(state.f[None], state.k[None], state.r[None])
    inputs = policy_inputs(observer.context, encoder)
    options = OptionRollouts(observer.figures, CAR, inputs, never_boxes, races, np.zeros((1, 0), np.float32), always=True, salt=5)
    for number in range(4):
        read.clear()
        options.run([Option(0, HARD)], 1, SEED, first=number, threads=1)
        rows, _ = driven_as_a_race(CHEAP, state, number, -1, stream_seed(5, SEED))
        assert len(read) > 2
        np.testing.assert_array_equal(np.stack(read), encoder(rows[10 : 10 + len(read)]))


def test_a_batch_of_futures_ends_as_the_races_do() -> None:
    state = state_after(CHEAP, 13)
    futures = FutureBatch(compile_figures(CHEAP), CAR, state, 3, SEED)
    for call in (HARD, *[0] * (CHEAP.laps - 14)):
        futures.advance(call)
    for i in range(3):
        _, batch = driven_as_a_race(CHEAP, state, i, CAR)
        for part, race in zip(futures.races, (batch.f, batch.k, batch.r), strict=True):
            np.testing.assert_array_equal(part[i], race[0])


def test_futures_find_a_stop_that_costs_nothing_under_a_safety_car() -> None:
    # wear is heavy and a stop under the safety car is free
    record = synthetic_race(laps=20, pace_step_s=0.02, plans=("S-H@10",), **quiet(loss_sc_s=0.0, loss_green_s=30.0))
    figures = compile_figures(record)
    environment = RaceEnvironment(record, CAR)
    environment.reset(1, np.array([0], np.int64))
    for _ in range(9):
        environment.step(np.zeros(1, np.int8))
    environment.races.r[0, at.R_STATUS], environment.races.r[0, at.R_LEFT] = 2, 2
    b = environment.races
    state = (b.f[0], b.k[0], b.r[0])
    places = rollouts(record, 1.0).run(state, belief_of(figures, b.f[0]), np.array([0, 3]), seed=1, first=0, futures=16)
    assert places[:, 1].mean() < places[:, 0].mean() - 1.0
