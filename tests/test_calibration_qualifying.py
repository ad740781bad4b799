"""Qualifying laps on one level, though the track gets quicker from session to session."""

import pytest

from rsrl.calibration.qualifying import qualifying_laps_s

LAPS = {f"D{i:02d}": 80.0 + 0.1 * i for i in range(20)}  # on the track as it is in Q3
GAINS = (1.01, 1.004, 1.0)


def sessions(laps: dict[str, float] = LAPS) -> dict[str, list[float | None]]:
    """Everyone drives the same lap in each session; the track is 1 per cent slower in Q1; 15 reach Q2, 10 reach Q3."""
    return {d: [t * g if i < n else None for g, n in zip(GAINS, (20, 15, 10), strict=True)] for i, (d, t) in enumerate(laps.items())}


def test_who_is_out_early_loses_nothing_to_the_track() -> None:
    assert qualifying_laps_s(sessions()) == pytest.approx(LAPS)


def test_the_quickest_is_the_pole_time_to_the_bit() -> None:
    assert min(qualifying_laps_s(sessions()).values()) == 80.0


def test_a_lap_that_failed_in_q3_is_replaced_by_the_one_of_q2() -> None:
    times = sessions()
    times["D05"][2] = None
    assert qualifying_laps_s(times)["D05"] == pytest.approx(LAPS["D05"])


def test_a_wet_last_session_does_not_make_those_who_missed_it_quick() -> None:
    times = {d: [q1, q2, None if q3 is None else 1.2 * q3] for d, (q1, q2, q3) in sessions().items()}
    found = qualifying_laps_s(times)
    assert found["D19"] / found["D00"] == pytest.approx(LAPS["D19"] / LAPS["D00"])


def test_two_drivers_do_not_tell_how_the_track_changed() -> None:
    assert qualifying_laps_s({"A": [81.0, 80.0, None], "B": [81.5, 81.0, None], "C": [81.2, None, None]}) == pytest.approx(
        {"A": 80.0, "B": 81.0, "C": 81.2}
    )


def test_without_times_there_is_nothing() -> None:
    assert qualifying_laps_s({}) == qualifying_laps_s({"A": [None, None, None]}) == {}
