"""The clean-air outlook is the exact optimum: brute force over every sequence of calls of a short race."""

import itertools

import numpy as np
import pytest
from slow_features import SlowFeatures
from synthetic_race import quiet, synthetic_race

from rsrl.season import RaceRecord
from rsrl.simulator import Plan, compile_figures, simulate
from rsrl.state import outlook_table

LAPS = 7
SHAPES = {
    "mild": None,
    "steep wear": {"S": (-1.0, 1.5, 0.3, 0.2), "M": (0.0, 1.0, 0.1, 0.4), "H": (1.0, 0.1, 0.0, 0.9)},
    "slow new tyres": {"S": (3.0, 0.0, 0.0, 0.0), "M": (0.0, 0.05, 0.0, 0.0), "H": (4.0, 0.0, 0.0, 2.0)},
}


def brute_force(record: RaceRecord, stop_s: float, lap: int, valid: bool, compound: int, age: int) -> float:
    """Least time to the flag over all calls on laps lap + 1 ... LAPS - 1."""
    cost_of, cold = SlowFeatures(record, 0, [stop_s] * 3).lap_cost, [t.cold_loss_s.value for t in record.tyres.values()]
    best = np.inf
    for calls in itertools.product(range(4), repeat=max(LAPS - lap - 1, 0)):
        total, used, fitted, laps_on, legal = 0.0, valid, compound, age, True
        for call in (*calls, 0)[: LAPS - lap]:
            legal &= not record.max_laps_per_set or laps_on < record.max_laps_per_set
            total += cost_of(fitted, laps_on)
            laps_on += 1
            if call:
                used |= call - 1 != fitted
                fitted, laps_on = call - 1, 0
                total += stop_s + cold[fitted]
        if used and legal:
            best = min(best, total)
    return best


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("limit", [0, 3])
@pytest.mark.parametrize("stop_s", [20.0, 0.5])
def test_the_table_is_the_exact_optimum(shape: str, limit: int, stop_s: float) -> None:
    plans = ("S-H@3-M@5",) if limit else ("S-H@3",)
    record = synthetic_race(laps=LAPS, max_laps_per_set=limit, plans=plans, tyres=SHAPES[shape])
    table = outlook_table(compile_figures(record), stop_s, 0)
    assert table.shape == (LAPS + 1, 2, 3, LAPS + 1)
    for lap, age in ((1, 0), (1, 2), (3, 0), (3, 1), (4, 2), (5, 2), (5, 5), (6, 0), (6, 1), (6, 6), (3, 4)):
        for valid, compound in itertools.product((False, True), range(3)):
            exact = brute_force(record, stop_s, lap, valid, compound, age)
            value = table[lap, int(valid), compound, age]
            if np.isinf(exact):
                assert value > 9e4
            else:
                assert value == pytest.approx(exact, abs=2e-3)


def test_the_best_plan_of_a_car_alone_takes_what_the_table_says() -> None:
    """The table against the simulator: least race time over all one- and two-stop plans, from a start on medium."""
    record = synthetic_race(cars=1, laps=12, **quiet())
    table = outlook_table(compile_figures(record), 20.0, 0)
    stints: list[tuple[tuple[int, ...], tuple[int, ...]]] = [(c, (lap,)) for c in itertools.product((1,), range(3)) for lap in range(1, 12)]
    stints += [(c, laps) for c in itertools.product((1,), range(3), range(3)) for laps in itertools.combinations(range(1, 12), 2)]
    plans = [Plan(c, laps) for c, laps in stints if len(set(c)) > 1 and max(c.count(x) for x in range(3)) < 3]
    times = [float(simulate(record, 1, 1, plans={0: p}, threads=1).race_time_s[0, 0]) for p in plans]
    base = 12 * 90.0 + 4.0 + record.cars[0].pace_s.value * 12 + 0.03 * 100.0 * 6.0
    assert min(times) - base == pytest.approx(float(table[0, 0, 1, 0]), abs=0.02)
