"""The planner: the known optimum of races without luck, blind to what is hidden, within its budget, the same in any batch."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from reactive_race import reactive
from synthetic_race import quiet, synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.rollouts import B_PACE, B_STINT, PaceFilter
from rsrl.season import GREEN, SC, RaceRecord
from rsrl.simulator import Plan, available_cores, compile_figures, simulate_plans
from rsrl.simulator import layout as at
from rsrl.state import expected_stop_s
from rsrl.state.outlook import outlook_table
from rsrl.strategists import PlannerStrategist
from rsrl.strategists.lookahead import planner
from rsrl.strategists.lookahead.candidates import Candidates, CandidateStops, shortlist
from rsrl.strategists.lookahead.clean_air_values import clean_air_values, offset_grid
from rsrl.strategists.lookahead.successive_rejects import best_candidate
from rsrl.strategists.plan_search.neighbours import is_legal

CAR = 9


def played(record: RaceRecord, strategist: PlannerStrategist, races: list[int], scramble: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Calls int8 [races, laps] and positions. `scramble`: the planner decides on a state whose hidden parts are nonsense."""
    environment = RaceEnvironment(record, CAR, batch=len(races))
    numbers = np.array(races, np.int64)
    environment.reset(4, numbers)
    strategist.begin(environment, 4, numbers)
    calls = np.zeros((len(races), record.laps), np.int8)
    b = environment.races
    for lap in range(record.laps):
        kept = [part.copy() for part in (b.f, b.k, b.r)]
        if scramble:
            scramble_hidden(b.f, b.k, b.r, lap)
        calls[:, lap] = np.where(environment.done, 0, strategist.decide(environment))
        for part, before in zip((b.f, b.k, b.r), kept, strict=True):
            part[:] = before
        environment.step(calls[:, lap])
    return calls, environment.outcome().position


def scramble_hidden(f: np.ndarray, k: np.ndarray, r: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for row in (at.F_PACE, at.F_OFFSET, at.F_USE, at.F_RAW):
        f[:, row] = rng.normal(0, 3, f[:, row].shape)
    for row in (at.K_RETIRE, at.K_PLAN, at.K_NEXT, at.K_POINTER, at.K_WANT, at.K_BITS, at.K_BOX):
        k[:, row] = rng.integers(0, 50, k[:, row].shape)
    for i in (at.R_KEY0, at.R_KEY1, at.R_RETIREMENT, at.R_LEFT):
        r[:, i] = rng.integers(1, 1000, len(r))


def free_running(**figures: float) -> dict[str, Any]:
    """Cars that pass at will and never hold each other up, without luck: places follow from race time alone."""
    free = {
        "start_per_place_s": 0.0, "drs_gain_s": 0.0, "dirty_air_loss_s": 0.0, "following_gap_s": 0.0, "pass_threshold_s": -100.0,
        "pass_loss_s": 0.0, "blue_flag_loss_s": 0.0, "lapping_loss_s": 0.0, "loss_green_s": 5.0,
    }  # fmt: skip
    return quiet(**{**free, **figures})


def test_finds_the_place_of_the_best_plan_where_there_is_no_luck() -> None:
    record = synthetic_race(laps=14, pace_step_s=0.15, plans=("S-H@6",), **free_running())
    plans = [Plan((0, c), (lap,)) for c in (1, 2) for lap in range(1, 14)]
    plans += [Plan((0, a, b), (i, j)) for a in range(3) for b in range(3) for i in range(1, 13) for j in range(i + 1, 14)]
    plans = [plan for plan in plans if is_legal(plan, record, CAR)]
    positions, _ = simulate_plans(compile_figures(record), CAR, plans, 4, np.zeros(1, np.int64))
    best = positions[:, 0].min()
    assert (positions == best).mean() < 0.2, "few plans reach it"
    _, position = played(record, PlannerStrategist(record, CAR, 0, 2.0), [0])
    assert position[0] == best


def test_takes_the_cheap_stop_under_a_safety_car() -> None:
    record = synthetic_race(sc_per_lap=0.12, loss_green_s=22.0, loss_sc_s=3.0, sc_laps=(1.0,), plans=("S-H@8",), retire_per_lap=0.0)
    environment = RaceEnvironment(record, CAR, batch=64)
    numbers = np.arange(64, dtype=np.int64)
    environment.reset(4, numbers)
    strategist = PlannerStrategist(record, CAR, 0, 1.0)
    strategist.begin(environment, 4, numbers)
    taken, chances = 0, 0
    for _ in range(record.laps):
        b = environment.races
        lap = b.r[:, at.R_LAP]
        due = (b.r[:, at.R_STATUS] == SC) & (b.k[:, at.K_STOPS, CAR] == 0) & (lap >= 5) & (lap <= 10) & ~environment.done
        calls = strategist.decide(environment)
        taken, chances = taken + int((calls[due] > 0).sum()), chances + int(due.sum())
        environment.step(calls)
    assert chances > 10
    assert taken == chances


@pytest.mark.parametrize("reacting", [False, True])
def test_never_sees_hidden_luck(reacting: bool) -> None:
    record = synthetic_race(stint_sd_s=0.3)
    record = reactive(record, 0.1) if reacting else record
    calls, _ = played(record, PlannerStrategist(record, CAR, 0, 1.0), list(range(12)))
    again, _ = played(record, PlannerStrategist(record, CAR, 0, 1.0), list(range(12)), scramble=True)
    np.testing.assert_array_equal(calls, again)
    assert (calls > 0).any()


def test_same_calls_in_any_batch_and_on_any_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    record = synthetic_race(stint_sd_s=0.3)
    calls, _ = played(record, PlannerStrategist(record, CAR, 0, 1.0), list(range(20)))
    for races in ([7], [19, 2, 7]):
        np.testing.assert_array_equal(played(record, PlannerStrategist(record, CAR, 0, 1.0), races)[0], calls[races])
    for cores in (1, 2 * available_cores() + 1):
        monkeypatch.setattr(planner, "available_cores", lambda cores=cores: cores)
        np.testing.assert_array_equal(played(record, PlannerStrategist(record, CAR, 0, 1.0), list(range(20)))[0], calls)
    other, _ = played(record, PlannerStrategist(record, CAR, 1, 1.0), list(range(20)))
    assert (other != calls).any(), "its own seed names its futures"


def test_a_budget_is_kept_and_more_of_it_is_used() -> None:
    record = synthetic_race()
    spent = {}
    for budget_ms in (0.0005, 0.5, 8.0):
        strategist = PlannerStrategist(record, CAR, 0, budget_ms)
        environment = RaceEnvironment(record, CAR, batch=8)
        numbers = np.arange(8, dtype=np.int64)
        environment.reset(4, numbers)
        strategist.begin(environment, 4, numbers)
        most = 0
        for _ in range(record.laps):
            environment.step(strategist.decide(environment))
            most = max(most, int(strategist.laps_simulated.max()))
            assert (strategist.laps_simulated <= strategist.budget_laps).all()
        spent[budget_ms] = most
    assert spent[0.0005] == 0
    assert 0 < spent[0.5] < spent[8.0]
    with pytest.raises(RsrlError, match="budget_ms is 0"):
        PlannerStrategist(record, CAR, 0, 0)


def test_form_is_learned_from_laps() -> None:
    record = synthetic_race(laps=30, stint_sd_s=0.4, form_sd_s=0.3, sc_per_lap=0.0, vsc_per_lap=0.0, pace_step_s=0.2)
    environment = RaceEnvironment(record, CAR, batch=64)
    environment.reset(9, np.arange(64, dtype=np.int64))
    b = environment.races
    watch = PaceFilter(b.figures, 64)
    for _ in range(12):
        watch.update(b.f, b.k, b.r)
        environment.step(np.zeros(64, np.int8))
    watch.update(b.f, b.k, b.r)
    seen = (b.k[:, at.K_PLACE] < b.r[:, at.R_RUNNING, None]) & (b.k[:, at.K_AGE] > 8)
    form = b.f[:, at.F_PACE] - b.figures.cars[at.C_PACE]
    luck = b.f[:, at.F_OFFSET] - b.figures.tyres[b.k[:, at.K_COMPOUND], at.Y_OFFSET]
    known = watch.belief[:, B_PACE] - b.figures.cars[at.C_PACE] + watch.belief[:, B_STINT]
    error = (form + luck - known)[seen]
    assert seen.sum() > 100
    assert error.std() < 0.5 * (form + luck)[seen].std()
    assert abs(error.mean()) < 0.05


def test_foresight_is_the_clean_air_outlook_where_there_is_no_luck() -> None:
    figures = compile_figures(synthetic_race(**quiet()))
    foresight = clean_air_values(figures, CAR)
    plain = outlook_table(figures, expected_stop_s(figures, CAR), CAR)
    possible = plain < 1e4
    for luck in range(foresight.value.shape[-1]):
        np.testing.assert_allclose(foresight.value[..., luck][possible], plain[possible], rtol=1e-4, atol=2e-3)
    lucky = clean_air_values(compile_figures(synthetic_race(**quiet(stint_sd_s=0.5))), CAR)
    assert (lucky.new[2, 1, 1:] < foresight.new[2, 1, 1:]).all(), "a bad set may be taken off, so luck that shows is worth something"
    deviation_s, share = offset_grid(0.5)
    assert share @ deviation_s == pytest.approx(0)
    assert share @ deviation_s**2 == pytest.approx(0.25)


def test_candidates_are_every_legal_next_stop_with_its_clean_air_time() -> None:
    record = synthetic_race(**quiet())
    figures = compile_figures(record)
    stops = CandidateStops(figures, clean_air_values(figures, CAR), CAR)
    every = stops.every_stop(
        lap=6,
        status=GREEN,
        compound=0,
        age=5,
        used=1,
        stops_made=0,
        sets=np.array([1, 0, 2], np.int32),
        legal=np.array([1, 1, 0, 1], np.bool_),
        stint_offset_s=0.0,
    )
    assert {(int(a), int(c)) for a, c in zip(every.lap, every.compound, strict=True)} == {(a, c) for a in range(6, 16) for c in (0, 2)}
    assert every.cost_s.min() == 0
    np.testing.assert_array_equal(every.call, np.where(every.lap == 6, every.compound + 1, 0))
    slower = stops.every_stop(
        lap=6,
        status=GREEN,
        compound=0,
        age=5,
        used=1,
        stops_made=0,
        sets=np.array([1, 0, 2], np.int32),
        legal=np.array([1, 1, 0, 1], np.bool_),
        stint_offset_s=1.0,
    )
    assert slower.lap[slower.cost_s.argmin()] < every.lap[every.cost_s.argmin()], "a slow set comes off sooner"
    few = shortlist(every, 5, 100.0)
    assert len(few.lap) == 5
    assert {1, 3} <= set(few.call), "every stop on the coming lap is among them"
    assert list(few.lap) == sorted(few.lap)


def test_trial_finds_the_best_of_noisy_candidates_within_its_runs() -> None:
    rng = np.random.default_rng(0)
    truth = np.array([5.0, 4.0, 4.4, 5.5, 6.0, 4.9])
    candidates = Candidates(np.arange(6), np.zeros(6, np.int64), np.zeros(6), np.array([1, 0, 2, 0, 0, 3]))
    runs = []

    def race(alive: np.ndarray, more: int) -> np.ndarray:
        runs.append(more * len(alive))
        return (truth[alive] + rng.normal(0, 1, (more, len(alive)))).astype(np.float32)

    assert best_candidate(candidates, race, 900) == 1
    assert sum(runs) <= 900
    runs.clear()
    prior = dataclasses.replace(candidates, cost_s=np.array([3.0, 3, 3, 0, 3, 3]))
    assert best_candidate(prior, race, 5) == 3, "what clean air says where nothing could be raced"
    assert not runs
