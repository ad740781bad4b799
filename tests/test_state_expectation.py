"""Expected time to the flag with safety cars allowed for: against the clean-air outlook, brute force, and numbers worked out by hand."""

import itertools
from functools import cache

import numpy as np
import pytest
from every_call import least_time_s
from hypothesis import given
from hypothesis import strategies as st
from slow_features import SlowFeatures
from synthetic_race import quiet, synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.season import GREEN, RED, SC, VSC, RaceRecord
from rsrl.simulator import compile_figures
from rsrl.simulator import layout as at
from rsrl.state import Expectation, expectation_table, expected_calls_of_rows, expected_stop_s, outlook_table

IMPOSSIBLE = 9.0e4
Left = tuple[int, int, int]
Shapes = dict[str, tuple[float, float, float, float]]
STEEP: Shapes = {"S": (-1.0, 1.5, 0.3, 0.2), "M": (0.0, 1.0, 0.1, 0.4), "H": (1.0, 0.1, 0.0, 0.9)}
FLAT: Shapes = {"S": (0.0, 1.0, 0.0, 0.5), "M": (0.0, 1.0, 0.0, 0.5), "H": (0.0, 1.0, 0.0, 0.5)}


def table_of(record: RaceRecord, **options: float) -> Expectation:
    return expectation_table(compile_figures(record), 0, **options)


def combo(record: RaceRecord, left: Left) -> int:
    sets = record.sets
    return (left[0] * (sets[1] + 1) + left[1]) * (sets[2] + 1) + left[2]


def calls_s(table: Expectation, lap: int, status: int, left: Left, compound: int, age: float, used: int) -> np.ndarray:
    out = np.zeros((1, 4), np.float32)
    whole = [np.array([v], np.int32) for v in (lap, status, compound, used)]
    expected_calls_of_rows(
        table, whole[0], whole[1], np.array([left], np.int32), whole[2], np.array([age], np.float32), whole[3], out
    )  # fmt: skip
    return out[0]


@pytest.mark.parametrize("limit", [0, 8])
@pytest.mark.parametrize("tyres", [None, STEEP])
def test_without_safety_cars_and_with_plenty_of_sets_it_is_the_outlook(limit: int, tyres: Shapes | None) -> None:
    plans = ("S-H@7-S@11",) if limit else ("S-H@7",)
    record = synthetic_race(laps=14, sets=(8, 8, 8), max_laps_per_set=limit, plans=plans, tyres=tyres, **quiet())
    figures = compile_figures(record)
    table, outlook = expectation_table(figures, 0), outlook_table(figures, expected_stop_s(figures, 0), 0)
    for compound in range(3):
        left = (7, 7, 8) if compound < 2 else (7, 8, 7)
        used_two = table.value[:, GREEN, combo(record, left), compound]
        np.testing.assert_allclose(np.minimum(used_two, 1e5), np.minimum(outlook[:, 1, compound], 1e5), atol=2e-3)
        left = (8 - (compound == 0), 8 - (compound == 1), 8 - (compound == 2))
        used_one = table.value[:, GREEN, combo(record, left), compound]
        # from two laps before the end on, the rules force the second stop: the outlook does not mind when
        np.testing.assert_allclose(np.minimum(used_one[:12], 1e5), np.minimum(outlook[:12, 0, compound], 1e5), atol=2e-3)


@pytest.mark.parametrize("sets", [(2, 1, 1), (1, 1, 2), (2, 0, 1)])
def test_with_few_sets_it_is_the_best_of_all_plans(sets: tuple[int, int, int]) -> None:
    """Every sequence of calls of a short race that the sets and the two-compound rule allow."""
    laps, stop_s = 7, 3.0
    record = synthetic_race(laps=laps, sets=sets, plans=("S-H@3",), tyres=STEEP, **quiet(loss_green_s=stop_s))
    cost, cold = SlowFeatures(record, 0, [stop_s] * 3).lap_cost, [t.cold_loss_s.value for t in record.tyres.values()]
    table = table_of(record)

    def two_used(left: list[int]) -> bool:
        return sum(n < s for n, s in zip(left, sets, strict=True)) > 1

    for start in (c for c in range(3) if sets[c]):
        best = least_time_s(cost, cold, stop_s, sets, start, laps, two_used)
        first = (sets[0] - (start == 0), sets[1] - (start == 1), sets[2] - (start == 2))
        assert table.value[0, GREEN, combo(record, first), start, 0] == pytest.approx(best, abs=2e-3)
        assert calls_s(table, 0, GREEN, first, start, 0, 1 << start).min() == pytest.approx(best, abs=2e-3)


def expectimax(record: RaceRecord, start: int, age: int, lap: int, status: int) -> float:
    """The same quantity by plain recursion over calls and statuses, in doubles; slow laps must age a set by whole laps."""
    i, laps, tail = record.incidents, record.laps, compile_figures(record).tail.mean()
    p = record.pit
    stop_s = [float(v + tail) for v in (p.loss_green_s.value, p.loss_vsc_s.value, p.loss_sc_s.value)] + [0.0]
    cost, cold = SlowFeatures(record, 0, stop_s).lap_cost, [t.cold_loss_s.value for t in record.tyres.values()]
    ageing = [1, round(i.vsc_wear_factor.value), round(i.sc_wear_factor.value), round(i.sc_wear_factor.value)]
    ends = {s: 1 / sum((n + 1) * share for n, share in enumerate(shares)) for s, shares in ((VSC, i.vsc_laps), (SC, i.sc_laps))}

    def following(lap: int, now: int) -> dict[int, float]:
        if now == GREEN:
            sc = i.sc_lap1.value if lap == 1 else i.sc_per_lap.value
            vsc, red = i.vsc_per_lap.value, i.red_share.value
            return {GREEN: 1 - sc - vsc, VSC: vsc, SC: sc * (1 - red), RED: sc * red}
        return {GREEN: 1.0} if now == RED else {GREEN: ends[now], now: 1 - ends[now]}

    @cache
    def value(lap: int, now: int, left: tuple[int, ...], fitted: int, laps_on: int, fresh: bool) -> float:
        used = {c for c in range(3) if left[c] < record.sets[c]}
        if lap > laps:
            return 0.0 if len(used) > 1 else np.inf
        here = cost(fitted, laps_on) + cold[fitted] * fresh if now == GREEN else 0.0
        nexts = following(lap, now)

        def onward(left: tuple[int, ...], fitted: int, laps_on: int, fresh: bool) -> float:
            return sum(p * value(lap + 1, s, left, fitted, laps_on, fresh) for s, p in nexts.items() if p > 0)

        options = [onward(left, fitted, laps_on + ageing[now], False)]
        if lap < laps:
            options += [stop_s[now] + onward(tuple(n - (k == c) for k, n in enumerate(left)), c, 0, True) for c in range(3) if left[c] > 0]
        return here + min(options)

    left = tuple(n - (c == start) for c, n in enumerate(record.sets))
    return value(lap + 1, status, left, start, age, False)


@pytest.mark.parametrize("sets", [(2, 1, 1), (2, 2, 2)])
@pytest.mark.parametrize("red_share", [0.0, 0.3])
def test_with_safety_cars_it_is_the_expected_time_by_plain_recursion(sets: tuple[int, int, int], red_share: float) -> None:
    record = synthetic_race(
        laps=8, sets=sets, plans=("S-H@3",), tyres=STEEP, sc_per_lap=0.12, vsc_per_lap=0.1, red_share=red_share,
        loss_green_s=6.0, loss_vsc_s=4.0, loss_sc_s=2.0, sc_wear_factor=0.0, vsc_wear_factor=1.0,
    )  # fmt: skip
    table = table_of(record)
    for start, status, (lap, age) in itertools.product(range(3), (GREEN, VSC, SC, RED), ((1, 1), (3, 2), (5, 0))):
        left = (sets[0] - (start == 0), sets[1] - (start == 1), sets[2] - (start == 2))
        exact = expectimax(record, start, age, lap, status)
        assert table.value[lap, status, combo(record, left), start, age] == pytest.approx(exact, abs=5e-3)


def test_a_certain_safety_car_is_waited_for() -> None:
    """Six laps, a safety car on laps 3 and 5, every tyre a second slower with each lap: worked out by hand.

    Green laps are 1, 2, 4 and 6. Stopping at the end of lap 3 costs 10 s and a cold half second; ages of the green laps are
    0, 1, 0 and then 1, as the slow lap 5 ages by nothing: 2 s. A stop at the end of lap 2 costs 20 s, and no cold lap.
    """
    record = synthetic_race(
        laps=6, plans=("S-H@3",), tyres=FLAT, **quiet(sc_per_lap=1.0, sc_wear_factor=0.0, loss_green_s=20.0, loss_sc_s=10.0), sc_laps=(1.0,)
    )  # fmt: skip
    table = table_of(record)
    left = (1, 2, 2)
    assert table.value[0, GREEN, combo(record, left), 0, 0] == pytest.approx(0 + 1 + 10.5 + 0 + 1)
    now = calls_s(table, 1, GREEN, left, 0, 1, 1)  # lap 2: age 1 costs 1 s
    assert now[0] == pytest.approx(1 + 10.5 + 0 + 1)
    assert now[1] == pytest.approx(1 + 20 + 0 + 10.5)  # softs again do not serve the rule: a second stop on lap 5
    assert now[2] == now[3] == pytest.approx(1 + 20 + 0 + 0 + 1)  # lap 3 behind the safety car warms and ages nothing; lap 4 at age 0
    under_sc = calls_s(table, 2, SC, left, 0, 2, 1)
    assert under_sc.argmin() in (2, 3)
    assert under_sc[0] == pytest.approx(0 + 2 + 10.5 + 0)  # the safety car of lap 5 would still do
    assert under_sc[2] == pytest.approx(10.5 + 0 + 1)


def test_a_free_change_under_a_red_flag_is_taken() -> None:
    record = synthetic_race(laps=12, tyres=STEEP, red_share=1.0)
    table = table_of(record)
    assert calls_s(table, 5, RED, (1, 2, 2), 0, 4, 1).argmin() > 0
    assert table.value[5, RED, combo(record, (1, 2, 2)), 0, 4] < table.value[5, SC, combo(record, (1, 2, 2)), 0, 4]


@pytest.mark.parametrize(("limit", "plans"), [(0, ("S-H@6", "M-H@8", "H-M@9")), (6, ("S-H@5-M@10", "M-H@6-S@11", "H-M@6-S@11"))])
def test_calls_it_allows_are_the_legal_ones(limit: int, plans: tuple[str, ...]) -> None:
    """On races driven at random: a call has a possible value only where the environment lets it be made."""
    record = synthetic_race(laps=16, max_laps_per_set=limit, plans=plans, sc_per_lap=0.1, retire_per_lap=0.0, retire_lap1=0.0)
    environment = RaceEnvironment(record, 0, batch=300)
    environment.reset(5, np.arange(300, dtype=np.int64))
    table, rng, out = table_of(record), np.random.default_rng(0), np.zeros((300, 4), np.float32)
    for _ in range(record.laps):
        k, r = environment.races.k[:, :, 0], environment.races.r
        sets_left = np.ascontiguousarray(k[:, at.K_SOFT_SETS : at.K_SOFT_SETS + 3])
        age = k[:, at.K_AGE].astype(np.float32)
        expected_calls_of_rows(table, r[:, at.R_LAP], r[:, at.R_STATUS], sets_left, k[:, at.K_COMPOUND], age, k[:, at.K_USED], out)
        np.testing.assert_array_equal(out < IMPOSSIBLE, environment.legal)
        drawn = np.where(environment.legal, rng.random((300, 4)) * [3, 1, 1, 1], -1)
        environment.step(drawn.argmax(axis=1).astype(np.int8))


@given(lap=st.integers(0, 14), status=st.sampled_from([GREEN, VSC, SC, RED]), age=st.floats(0, 15, width=32), data=st.data())
def test_the_best_call_has_the_value_of_the_state(lap: int, status: int, age: float, data: st.DataObject) -> None:
    record, table = RACE, RACE_TABLE
    compound = data.draw(st.integers(0, 2))
    spare = [n - (c == compound) for c, n in enumerate(record.sets)]
    left = (data.draw(st.integers(0, spare[0])), data.draw(st.integers(0, spare[1])), data.draw(st.integers(0, spare[2])))
    used = sum(1 << c for c in range(3) if left[c] < record.sets[c])
    row = table.value[lap, status, combo(record, left), compound]
    best = calls_s(table, lap, status, left, compound, round(age), used).min()
    assert best == pytest.approx(row[round(age)], abs=0.02)
    worse = calls_s(table, lap, status, left, compound, age, used).min()
    low, high = np.float32(row[int(age)]), np.float32(row[min(int(age) + 1, 16)])
    assert low - 0.05 <= worse <= high + 0.05, "older tyres are never better"


RACE = synthetic_race(sets=(2, 1, 3))
RACE_TABLE = table_of(RACE)


def test_time_a_later_safety_car_gives_back_counts_less() -> None:
    record = synthetic_race(laps=30, plans=("S-H@12",), sc_per_lap=0.05)
    plain, closed = table_of(record), table_of(record, regained=1.0)
    assert (plain.counts == 1).all()
    assert (np.diff(closed.counts[2:31, GREEN]) > 0).all()
    assert closed.counts[30, GREEN] == 1
    assert closed.counts[29, GREEN] == pytest.approx(0.95)  # lap 30 alone can close the field up
    assert closed.counts[28, GREEN] == pytest.approx(1 - (0.05 + 0.03 * 0.0 + 0.92 * 0.05), abs=0.002)
    left = combo(record, (1, 2, 2))
    assert closed.value[5, GREEN, left, 0, 5] < plain.value[5, GREEN, left, 0, 5]
