"""A lap table told as events: when each was known, and what the table leaves open."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from invented_laps import race, table

from rsrl.errors import RsrlError
from rsrl.feeds import Entry, Event, LapCompleted, LapCount, PitIn, PitOut, Retired, Session, SessionOver, StatusChanged, TyreFitted
from rsrl.feeds.lap_files import FORMATION_S, OVERDUE_LAPS, _fitted, lap_events, read_lap_file
from rsrl.feeds.lap_status import Lap, status_changes
from rsrl.season import GREEN, RED, SC, VSC


def rows_of(rows: list[dict[str, Any]], driver: str) -> list[dict[str, Any]]:
    return [row for row in rows if row["driver"] == driver]


def of_kind(events: list[Event], kind: type, car: int | None = None) -> list[Any]:
    return [e for e in events if isinstance(e, kind) and car in (None, getattr(e, "car", None))]


def test_events_come_in_the_order_in_which_they_were_known() -> None:
    events = lap_events(table(race(drivers=3, laps=12)))
    assert [e.time_s for e in events] == sorted(e.time_s for e in events)
    (session,) = of_kind(events, Session)
    assert (session.kind, session.event, session.season, session.total_laps) == ("race", "Test Grand Prix", 2023, 12)
    assert session.time_s == 3602.0 - FORMATION_S  # D01, the middle car, crosses first 2 s after the others' lap 1 began
    assert [e.driver for e in of_kind(events, Entry)] == ["D00", "D01", "D02"]
    assert [(e.lap, e.lap_time_s, e.time_s) for e in of_kind(events, LapCompleted, 2)][:2] == [(1, 90.0, 3692.0), (2, 90.0, 3782.0)]
    assert [e.lap for e in of_kind(events, LapCount)] == list(range(1, 13))
    assert isinstance(events[-1], SessionOver)


def test_a_stop_is_pit_entry_line_exit_and_the_new_set() -> None:
    rows = race(drivers=3, laps=12)
    own = rows_of(rows, "D01")
    own[4]["pit_in_s"], own[5]["pit_out_s"] = own[4]["session_time_s"] - 3.0, own[4]["session_time_s"] + 18.0
    for lap, row in enumerate(own[5:]):
        row.update(compound="H", stint=2, tyre_life_laps=float(3 + lap), fresh_tyre=False)
    stop = [e for e in lap_events(table(rows)) if getattr(e, "car", 0) == 2 and 4045.0 < e.time_s < 4080.0]
    assert [type(e) for e in stop][:2] == [PitIn, LapCompleted]
    assert PitOut(4070.0, 2, 6) in stop
    assert TyreFitted(4070.0, 2, 2, "H", False, 2) in stop


def test_a_drive_through_has_no_new_set() -> None:
    rows = race(drivers=8, laps=20)
    for d in range(1, 6):  # the race's usual time in the pit lane is 22 s
        own = rows_of(rows, f"D{d:02d}")
        own[9]["pit_in_s"], own[10]["pit_out_s"] = own[9]["session_time_s"] - 3.0, own[9]["session_time_s"] + 19.0
        for lap, row in enumerate(own[10:]):
            row.update(compound="H", stint=2, tyre_life_laps=float(1 + lap))
    own = rows_of(rows, "D07")
    own[4]["pit_in_s"], own[5]["pit_out_s"] = own[4]["session_time_s"] - 3.0, own[4]["session_time_s"] + 12.0
    events = lap_events(table(rows))
    assert len(of_kind(events, PitIn, 8)) == 1
    assert [e.stint for e in of_kind(events, TyreFitted, 8)] == [1]
    assert [e.stint for e in of_kind(events, TyreFitted, 3)] == [1, 2]


def test_a_missing_first_lap_is_taken_from_the_second() -> None:
    rows = [row for row in race(drivers=3, laps=12) if row["lap"] > 1]
    first = [e for e in of_kind(lap_events(table(rows)), LapCompleted) if e.lap == 1]
    assert [(e.car, e.time_s, e.lap_time_s) for e in first] == [(1, 3690.0, None), (2, 3692.0, None), (3, 3694.0, None)]


def test_retirements_are_told_when_the_car_is_overdue_or_where_it_stopped() -> None:
    rows = [row for row in race(drivers=4, laps=14) if not (row["driver"] in ("D02", "D03") and row["lap"] > 6)]
    rows_of(rows, "D03")[-1].update(position=None, lap_time_s=None, session_time_s=4101.0)  # it stopped on lap 6
    events = lap_events(table(rows))
    assert [e.time_s for e in of_kind(events, Retired, 3)] == [3604.0 + 6 * 90 + OVERDUE_LAPS * 90]
    assert [e.time_s for e in of_kind(events, Retired, 4)] == [4101.0]
    assert max(e.lap for e in of_kind(events, LapCompleted, 4)) == 5
    assert not of_kind(events, Retired, 1)


def laps_under(spans: list[tuple[float, float, str]], cars: int = 12, gap_s: float = 3.0) -> list[Lap]:
    """Laps of 90 s with the digits that were out during each, as a source writes them."""
    laps = []
    for car in range(cars):
        for n in range(20):
            begin = 1000.0 + gap_s * car * (n > 0) + 90.0 * n
            end = 1000.0 + gap_s * car + 90.0 * (n + 1)
            laps.append(Lap(begin, end, "".join(digit for on, off, digit in spans if on < end and off > begin) or "1"))
    return laps


@pytest.mark.parametrize(("digit", "status"), [("4", SC), ("6", VSC), ("5", RED)])
@pytest.mark.parametrize("on_s", [1031.5, 1431.5, 1452.5, 1476.5])
def test_a_status_is_placed_between_the_crossings_around_it(digit: str, status: int, on_s: float) -> None:
    laps = laps_under([(on_s, on_s + 200.0, digit)])
    start, on, off = status_changes(laps)
    assert (start.status, on.status, off.status) == (GREEN, status, GREEN)
    crossings = sorted({time for lap in laps for time in lap[:2]})
    for true_s, placed in ((on_s, on), (on_s + 200.0, off)):
        before, after = max(t for t in crossings if t <= true_s), min(t for t in crossings if t >= true_s)
        assert before <= placed.time_s <= after


def test_a_digit_missing_here_and_there_changes_nothing() -> None:
    laps = laps_under([(1430.0, 1700.0, "4")])
    spoiled = [lap._replace(digits="1") if i % 13 == 5 else lap for i, lap in enumerate(laps)]
    assert sum(a != b for a, b in zip(laps, spoiled, strict=True)) > 2
    assert list(status_changes(spoiled)) == list(status_changes(laps))


def test_laps_without_digits_are_green() -> None:
    assert list(status_changes([lap._replace(digits=None) for lap in laps_under([])])) == [StatusChanged(1000.0, GREEN)]


def test_a_red_flag_lasts_until_the_field_leaves_the_pit_lane() -> None:
    """The lap on which cars wait has no digit of it, so that the digits alone end it as they come in; one a lap down leaves early."""
    laps = laps_under([(1430.0, 1520.0, "5")])
    passages = [(1500.0 + car, 2100.0 + 3 * car) for car in range(10)] + [(1530.0, 1980.0), (1200.0, 1222.0)]
    assert [(c.status, c.time_s) for c in status_changes(laps, passages)][2:] == [(GREEN, 2100.0)]
    assert status_changes(laps)[2].time_s < 1600.0


def test_a_safety_car_behind_which_a_race_goes_on_comes_after_the_red_flag() -> None:
    laps = laps_under([(1430.0, 1520.0, "5"), (1620.0, 1800.0, "4")])
    passages = [(1500.0 + car, 1770.0 + car) for car in range(10)]
    assert [(c.status, c.time_s) for c in status_changes(laps, passages)][2:-1] == [(SC, 1770.0)]


def test_the_red_flags_of_australia_2023_end_with_the_restarts(real_data: Path) -> None:
    """Exits of the pit lane in the lap file: 5527-5586 s on lap 9, 10505-10560 s on lap 56, 12725-12749 s for the last lap."""
    _, laps = read_lap_file(real_data / "laps" / "laps_2023.csv.gz", "australia-2023")
    changes = of_kind(lap_events(laps), StatusChanged)
    ends = [after.time_s for red, after in pairwise(changes) if red.status == RED]
    assert ends == pytest.approx([5527.2, 10505.4, 12725.4], abs=1.0)


def test_bahrain_2023_against_the_recorded_track_status(real_data: Path) -> None:
    _, laps = read_lap_file(real_data / "laps" / "laps_2023.csv.gz", "bahrain-2023")
    changes = of_kind(lap_events(laps), StatusChanged)
    assert [e.status for e in changes] == [GREEN, VSC, GREEN]
    # TrackStatus of the live timing: deployed 02:09:18.298, all clear 02:11:06.437
    assert changes[1].time_s == pytest.approx(7758.3, abs=10.0)
    assert changes[2].time_s == pytest.approx(7866.4, abs=10.0)


def test_a_file_of_several_races_needs_a_name(tmp_path: Path, real_data: Path) -> None:
    with pytest.raises(RsrlError, match="holds 22 races; name one with --race"):
        read_lap_file(real_data / "laps" / "laps_2023.csv.gz", None)
    with pytest.raises(RsrlError, match="unknown race 'atlantis'"):
        read_lap_file(real_data / "laps" / "laps_2023.csv.gz", "atlantis")


def test_laps_without_session_times_are_refused() -> None:
    rows = race(drivers=2, laps=10)
    for row in rows:
        row["session_time_s"] = None
    with pytest.raises(RsrlError, match="no session_time_s"):
        lap_events(table(rows))


WAITED = [(3876.0, 5461.0), (3878.0, 5462.0), (4003.0, 5406.0), (4005.0, 5407.0), (4100.0, 4123.0)]
"""Entry and exit of the pit lane: two cars came in for repairs before the red flag, one stopped before the line."""


def test_the_field_that_stands_in_the_pit_lane_stands_under_a_red_flag() -> None:
    """The digits miss a red flag on the first laps."""
    laps = laps_under([])
    started_s = min(lap.start_s for lap in laps)
    shifted = [(in_s - 3743.0 + started_s, out_s - 3743.0 + started_s) for in_s, out_s in WAITED]
    found = [(c.status, c.time_s - started_s) for c in status_changes(laps, shifted)]
    assert found == [(GREEN, 0.0), (RED, pytest.approx(250.0)), (GREEN, pytest.approx(1663.0))]
    assert len(status_changes(laps, shifted[:2])) == 1


def test_an_age_that_goes_on_is_not_that_of_a_new_set() -> None:
    row = {"compound": None, "fresh_tyre": True, "tyre_life_laps": 33.0}
    assert _fitted(0.0, 1, 3, row, 32.0).laps_before is None
    assert _fitted(0.0, 1, 3, row, 12.0).laps_before == 32
    assert _fitted(0.0, 1, 1, row).laps_before == 32
