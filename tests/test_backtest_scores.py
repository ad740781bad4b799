"""Scores of predictions, worked out by hand."""

import numpy as np
import pytest

from rsrl.evaluation.backtest.scores import MEASURES, Actual, Predicted, average, chances, differences, ranks, score


def actual(**changes: object) -> Actual:
    """Four cars that finish in order, the last not classified; two laps."""
    nan = np.nan
    parts: dict[str, object] = {
        "positions": np.array([1.0, 2.0, 3.0, 4.0]),
        "classified": np.array([True, True, True, False]),
        "stops": np.array([1.0, 2.0, 2.0, nan]),
        "first_stop": np.array([10.0, 12.0, 20.0, nan]),
        "lap_positions": np.array([[1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, nan]]),
        "green_lap_s": np.array([[90.0, 91.0, 92.0, nan], [90.0, nan, 92.0, nan]]),
        "sc_laps": 4,
    }
    return Actual(**{**parts, **changes})  # type: ignore[arg-type]


def predicted(**changes: object) -> Predicted:
    parts: dict[str, object] = {
        "position": np.array([1.0, 1.0, 4.0, 2.0]),
        "mean_position": np.array([2.0, 1.0, 3.5, 3.0]),
        "p_points": np.ones(4),
        "p_win": np.array([0.25, 0.5, 0.25, 0.0]),
    }
    return Predicted(**{**parts, **changes})  # type: ignore[arg-type]


def test_every_measure_by_hand() -> None:
    full = predicted(
        stops=np.array([1.5, 2.0, 1.0, 9.0]),
        first_stop=np.array([13.0, 16.0, 19.0, 5.0]),
        lap_positions=np.array([[1.0, 2.0, 3.0, 4.0], [2.0, 1.0, 3.0, 4.0]]),
        green_lap_s=np.full((2, 4), 91.0),
        sc_laps=3.0,
    )
    s = score(full, actual())
    assert list(s) == list(MEASURES)
    assert s["mae_position"] == pytest.approx((0 + 1 + 1 + 2) / 4)
    assert s["mae_rank_classified"] == pytest.approx(2 / 3)  # 2, 1, 3 against 1, 2, 3
    assert s["spearman"] == pytest.approx(1 - 6 * 4 / (4 * 15))  # ranks 2 1 4 3
    assert s["brier_points"] == 0.0  # all four end in the points
    assert s["logloss_winner"] == pytest.approx(np.log(4))
    assert s["mae_green_lap_s"] == pytest.approx((1 + 0 + 1 + 1 + 1) / 5)
    assert s["mae_lap_position"] == pytest.approx(2 / 7)
    assert s["stops_mae"] == pytest.approx(1.5 / 3)  # the classified alone
    assert s["first_stop_within_3"] == pytest.approx(2 / 3)
    assert (s["sc_laps_predicted"], s["sc_laps_actual"]) == (3.0, 4.0)


def test_what_a_predictor_does_not_say_is_nan_not_zero() -> None:
    s = score(predicted(), actual())
    assert np.isnan([s[n] for n in ("mae_green_lap_s", "mae_lap_position", "stops_mae", "first_stop_within_3", "sc_laps_predicted")]).all()


def test_a_winner_thought_impossible_costs_much_but_not_everything() -> None:
    s = score(predicted(p_win=np.array([0.0, 0.5, 0.5, 0.0])), actual())
    assert s["logloss_winner"] == pytest.approx(np.log(1000))


def test_chances_follow_the_spread() -> None:
    sure, _ = chances(np.arange(1.0, 21.0), 0.01)
    assert sure.tolist() == [1.0] * 10 + [0.0] * 10
    vague, win = chances(np.arange(1.0, 21.0), 1000.0)
    assert np.abs(vague - 0.5).max() < 0.05
    assert win.sum() == pytest.approx(1.0)


def test_differences_are_paired_by_race_and_their_interval_holds_the_mean() -> None:
    base = [dict.fromkeys(MEASURES, float(i)) for i in range(12)]
    better = [dict.fromkeys(MEASURES, i - 0.5 + 0.1 * (i % 3)) for i in range(12)]
    gap = differences(better, base)["mae_position"]
    assert gap.mean == pytest.approx(-0.4)
    assert -0.5 <= gap.low < gap.mean < gap.high < -0.3


def test_average_leaves_out_races_without_the_measure() -> None:
    rows = [dict.fromkeys(MEASURES, 1.0), {**dict.fromkeys(MEASURES, 3.0), "stops_mae": float("nan")}]
    assert average(rows)["stops_mae"] == 1.0
    assert average(rows)["mae_position"] == 2.0
    assert average(rows)["races"] == 2


def test_ranks_of_ties_keep_their_order() -> None:
    assert ranks(np.array([3.0, 1.0, 3.0])).tolist() == [2.0, 1.0, 3.0]
