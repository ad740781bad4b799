"""Same seed, same bits: for any threads and batch, for every way to run a race, compiled or not; and golden values."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from race_digest import digests
from synthetic_race import synthetic_race

from rsrl.simulator import Plan, RaceBatch, RaceResults, compile_figures, run_rows, simulate, simulate_plans, trace_races
from rsrl.simulator import layout as at

RECORD = synthetic_race()
PLANS = {4: Plan.parse("S-H@6"), 11: Plan((1, 2), (8,), 5, 5)}


def same(a: RaceResults, b: RaceResults, rows: slice = slice(None)) -> None:
    for name in ("positions", "stops", "retired", "race_time_s", "slow_laps"):
        np.testing.assert_array_equal(getattr(a, name)[rows], getattr(b, name), err_msg=name)


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("races", [1, 63, 65, 150])
def test_threads_and_chunks_never_change_a_race(threads: int, races: int) -> None:
    whole = simulate(RECORD, 150, 5, plans=PLANS, threads=2)
    same(whole, simulate(RECORD, races, 5, plans=PLANS, threads=threads), slice(0, races))
    if races > 1:
        same(whole, simulate(RECORD, races - 1, 5, plans=PLANS, threads=threads, first_race=1), slice(1, races))


def test_every_row_counts_as_done_once() -> None:
    calls: list[tuple[int, int]] = []
    simulate(RECORD, 150, 5, progress=lambda done, races: calls.append((done, races)))
    assert calls[-1] == (150, 150)
    assert [d for d, _ in calls] == sorted({d for d, _ in calls})


def test_other_seeds_and_race_numbers_are_other_races() -> None:
    runs = [simulate(RECORD, 50, seed, first_race=first) for seed, first in ((5, 0), (6, 0), (5, 50), (-5, 0))]
    assert len({r.race_time_s.tobytes() for r in runs}) == 4


def test_traced_and_stepped_races_are_the_simulated_ones() -> None:
    races = 40
    results = simulate(RECORD, races, 5, plans=PLANS)
    trace = trace_races(RECORD, races, 5, plans=PLANS)
    batch = RaceBatch(compile_figures(RECORD), races, plans=PLANS)
    batch.start(5, np.arange(races, dtype=np.int64))
    for lap in range(RECORD.laps):
        np.testing.assert_array_equal(trace.track_status[:, lap], batch.r[:, at.R_STATUS])
        batch.advance()
    batch.advance()  # after the flag nothing moves
    np.testing.assert_array_equal(batch.positions(), results.positions)
    finished = trace.running[:, -1]
    np.testing.assert_array_equal(finished, ~results.retired)
    np.testing.assert_allclose(trace.race_time_s[:, -1][finished], results.race_time_s[finished], atol=1e-3)
    np.testing.assert_array_equal(trace.stopped.sum(axis=1), results.stops)


def test_plans_for_one_car_are_run_as_if_each_were_alone() -> None:
    figures = compile_figures(RECORD)
    plans = [Plan.parse("S-H@6"), Plan.parse("M-S@9"), Plan.parse("H-M@5-S@11")]
    positions, times = simulate_plans(figures, 7, plans, 3, np.arange(30, dtype=np.int64))
    for i, plan in enumerate(plans):
        alone = simulate(RECORD, 30, 3, plans={7: plan})
        np.testing.assert_array_equal(positions[i], alone.positions[:, 7])
        np.testing.assert_array_equal(times[i], alone.race_time_s[:, 7])


def test_rows_may_name_races_in_any_order() -> None:
    figures = compile_figures(RECORD)
    numbers = np.array([7, 3, 3, 0], np.int64)
    result = run_rows(figures, figures.rival_plans, 5, numbers, np.full(20, at.RIVAL, np.int32))
    np.testing.assert_array_equal(result.positions, simulate(RECORD, 8, 5).positions[numbers])


def test_compiled_equals_plain_python() -> None:
    here = Path(__file__).parent
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join([str(here.parent / "src"), str(here)])}
    plain = subprocess.run([sys.executable, str(here / "race_digest.py")], capture_output=True, text=True, check=True, env=environment)
    assert plain.stdout.splitlines() == digests()


def test_golden_races() -> None:
    """A change here is a change of every simulated race: meant, or a fault. Three races of the synthetic record, seed 2023."""
    results = simulate(RECORD, 3, 2023)
    assert results.positions.tolist() == GOLDEN_POSITIONS
    assert results.slow_laps.tolist() == GOLDEN_SLOW_LAPS
    assert results.stops.sum(axis=1).tolist() == GOLDEN_STOPS
    winners = [np.float64(t[p == 1][0]) for t, p in zip(results.race_time_s, results.positions, strict=True)]
    np.testing.assert_allclose(winners, GOLDEN_WINNER_S, atol=2e-3)


GOLDEN_POSITIONS = [
    [1, 2, 3, 20, 4, 7, 18, 5, 17, 12, 8, 6, 9, 13, 10, 19, 14, 16, 11, 15],
    [1, 7, 2, 10, 9, 3, 4, 11, 17, 12, 13, 8, 20, 5, 6, 16, 18, 14, 19, 15],
    [2, 4, 5, 1, 3, 6, 8, 9, 7, 10, 11, 16, 20, 15, 17, 19, 18, 12, 14, 13],
]
GOLDEN_SLOW_LAPS = [[1, 0], [2, 1], [0, 0]]  # safety car, virtual
GOLDEN_STOPS = [24, 29, 23]
GOLDEN_WINNER_S = [1509.48, 1591.66, 1478.847]
