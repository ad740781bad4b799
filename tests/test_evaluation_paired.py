"""Races called by strategists side by side, the leaderboard's arithmetic and what was driven."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from rsrl.drawing import StintBar, plot_strategies
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.evaluation import RaceLog, common_strategies, leaderboard, plot_positions, run_races
from rsrl.season import RaceRecord
from rsrl.simulator import POINTS_BY_POSITION
from rsrl.statistics import mean_interval
from rsrl.strategists import HeuristicStrategist, Strategist, make_strategist

CAR = 6


class Stubborn(Strategist):
    """Never boxes, whatever the rules."""

    name = "stubborn"

    def begin(self, environment: RaceEnvironment, seed: int, races: np.ndarray) -> None:
        pass

    def decide(self, environment: RaceEnvironment) -> np.ndarray:
        return np.zeros(environment.batch, np.int8)


def log_of(positions: list[int], name: str = "x", **changes: object) -> RaceLog:
    """A log with these finishing positions and nothing else of interest."""
    position = np.array(positions, np.int64)
    n = len(position)
    log = RaceLog(
        strategist=name,
        races=np.arange(n, dtype=np.int64),
        position=position,
        points=POINTS_BY_POSITION[position],
        stops=np.full(n, 2, np.int64),
        invalid=np.zeros(n, np.bool_),
        retired=np.zeros(n, np.bool_),
        start=np.zeros(n, np.int8),
        calls=np.zeros((n, 57), np.int8),
        decision_ms=0.5,
    )
    return dataclasses.replace(log, **changes)  # type: ignore[arg-type]


def test_a_race_comes_out_the_same_however_many_are_asked_for(bahrain: RaceRecord) -> None:
    strategist = HeuristicStrategist(bahrain, CAR, 0)
    many = run_races(strategist, bahrain, CAR, 7, 500)
    few = run_races(strategist, bahrain, CAR, 7, 30)
    later = run_races(strategist, bahrain, CAR, 7, 20, first_race=390)
    for name in ("races", "position", "points", "stops", "invalid", "retired", "start", "calls"):
        np.testing.assert_array_equal(getattr(few, name), getattr(many, name)[:30])
        np.testing.assert_array_equal(getattr(later, name), getattr(many, name)[390:410])
    assert many.decision_ms > 0


def test_a_strategist_against_itself_differs_by_nothing(bahrain: RaceRecord) -> None:
    logs = [run_races(make_strategist("heuristic", bahrain, CAR), bahrain, CAR, 7, 40) for _ in range(2)]
    for row in leaderboard(logs[0], logs[1:]):
        assert row.difference == 0
        assert row.difference_ci95 == (0, 0)
        assert row.p_better == 0.5


def test_a_log_holds_what_happened(bahrain: RaceRecord) -> None:
    log = run_races(make_strategist("fixed", bahrain, CAR), bahrain, CAR, 7, 300)
    for i in range(300):
        compounds, laps = log.stints(i)
        assert len(compounds) == len(laps) + 1 == log.stops[i] + 1
        assert compounds[0] == log.start[i]
        if not log.retired[i]:
            assert len(set(compounds)) > 1
    np.testing.assert_array_equal(log.points, POINTS_BY_POSITION[log.position])
    assert 0.05 < log.retired.mean() < 0.3


def test_a_finish_out_of_the_rules_counts_as_invalid_but_a_retirement_does_not(bahrain: RaceRecord) -> None:
    log = run_races(Stubborn(), bahrain, CAR, 7, 200)
    assert log.retired.any()
    np.testing.assert_array_equal(log.invalid, ~log.retired)
    (row,) = leaderboard(log)
    assert row.invalid_share == pytest.approx(1 - row.retired_share)


def test_no_races_are_refused(bahrain: RaceRecord) -> None:
    with pytest.raises(RsrlError, match="races is 0; ask for one at least"):
        run_races(Stubborn(), bahrain, CAR, 7, 0)


def test_progress_counts_the_races_asked_for(bahrain: RaceRecord) -> None:
    told: list[tuple[int, int]] = []
    run_races(Stubborn(), bahrain, CAR, 7, 500, progress=lambda done, total: told.append((done, total)))
    assert told == sorted(told)
    assert told[-1] == (500, 500)
    assert (384, 500) in told
    assert len(told) > bahrain.laps, "lap by lap, for who takes long over a decision"


class Lonely(Stubborn):
    """Remembers how many races it is asked to call at once."""

    batch_invariant = True

    def __init__(self) -> None:
        self.batches: list[int] = []

    def begin(self, environment: RaceEnvironment, seed: int, races: np.ndarray) -> None:
        self.batches.append(len(races))


def test_no_batch_is_filled_up_for_who_calls_each_race_alone(bahrain: RaceRecord) -> None:
    lonely = Lonely()
    log = run_races(lonely, bahrain, CAR, 7, 400)
    assert lonely.batches[:2] == [384, 16]
    np.testing.assert_array_equal(log.position, run_races(Stubborn(), bahrain, CAR, 7, 400).position)


def test_interval_of_the_mean_is_student_s() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0])
    low, high = mean_interval(values)
    # mean 2.5, standard error sqrt(5 / 3) / 2, t(0.975, 3) = 3.18245
    assert low == pytest.approx(0.44574, abs=1e-4)
    assert high == pytest.approx(4.55426, abs=1e-4)
    assert (low, high) == pytest.approx(stats.t.interval(0.95, 3, 2.5, stats.sem(values)))
    assert mean_interval(np.array([3.0, 3.0])) == (3.0, 3.0)
    assert all(math.isnan(end) for end in mean_interval(np.array([3.0])))


def test_interval_covers_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    covered = [low <= 10.5 <= high for low, high in (mean_interval(rng.integers(1, 21, 200)) for _ in range(2000))]
    assert 0.935 < np.mean(covered) < 0.965


def test_rows_of_the_leaderboard() -> None:
    model = log_of([1, 5, 4, 10], "model")
    other = log_of([3, 5, 2, 12], "other", retired=np.array([False, False, False, True]))
    first, second = leaderboard(model, [other])
    assert (first.strategist, second.strategist) == ("model", "other")
    assert first.mean_position == 5.0
    assert first.mean_points == pytest.approx((25 + 10 + 12 + 1) / 4)
    assert second.difference == pytest.approx(0.5)
    assert second.difference_ci95 == mean_interval(np.array([2, 0, -2, 2]))
    assert second.p_better == pytest.approx((2 + 0.5) / 4)
    assert (second.mean_stops, second.retired_share, second.invalid_share, second.decision_ms) == (2, 0.25, 0, 0.5)
    assert [row.strategist for row in leaderboard(other, [model])] == ["model", "other"], "best first, whoever is the model"


def test_logs_of_other_races_are_not_compared() -> None:
    with pytest.raises(RsrlError, match="were not run on the same races"):
        leaderboard(log_of([1, 2, 3]), [log_of([1, 2])])
    with pytest.raises(RsrlError, match="were not run on the same races"):
        leaderboard(log_of([1, 2]), [log_of([1, 2], start=np.array([0, 1], np.int8))])


def test_common_strategies_with_their_windows() -> None:
    calls = np.zeros((11, 57), np.int8)
    for i in range(9):
        calls[i, 9 + i], calls[i, 29 + 2 * i] = 3, 1  # S-H-S, laps 10..18 and 30..46
    calls[9, 19] = 3  # S-H
    calls[10, 19] = 2  # retired
    log = log_of([*range(1, 12)], "x", calls=calls, retired=np.array([False] * 10 + [True]))
    first, second = common_strategies(log)
    assert (first.plan, first.races, first.share) == ("S-H@14-S@38", 9, 0.9)
    assert first.windows == ((11, 17), (32, 44))
    assert first.mean_position == 5.0
    assert (second.compounds, second.laps, second.windows) == ((0, 2), (20,), ((20, 20),))
    assert len(common_strategies(log, most=1)) == 1


def test_figures_are_written(tmp_path: Path) -> None:
    logs = [log_of([1, 2, 3, 7], "model"), log_of([4, 5, 6, 7], "fixed")]
    bars = [StintBar("S-H@14", "60 %", (0, 2), (14,), [(12, 16)], "model"), StintBar("M-H@20", "10 %", (1, 2), (20,), [None], "fixed")]
    plot_positions(logs, "title", tmp_path / "a.png")
    plot_strategies(bars, 57, "title", "window", tmp_path / "b.png")
    plot_strategies(bars[:1], 57, "title", "window", tmp_path / "c.png")
    for name in "abc":
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(RsrlError, match="cannot be written"):
        plot_positions(logs, "title", tmp_path / "none" / "a.png")
