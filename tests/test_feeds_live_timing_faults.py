"""Faults and habits of real feeds, each on a few hand-made lines."""

from typing import Any

import pytest
from live_timing_lines import DRIVERS, INFO, events_of, only, race_events, timing

from rsrl.feeds.anomalies import MOST_EXAMPLES, Anomalies
from rsrl.feeds.events import (
    Entry,
    Event,
    Gap,
    LapCompleted,
    LapCount,
    OvertakeAid,
    PitIn,
    PitOut,
    Position,
    RaceControl,
    Retired,
    Session,
    SessionOver,
    StatusChanged,
    TyreFitted,
    Weather,
)
from rsrl.feeds.live_timing import LiveTiming
from rsrl.feeds.live_timing.clock import session_clock
from rsrl.feeds.live_timing.messages import Message
from rsrl.season import GREEN, RED, SC, VSC

ON_LAP_20 = ("LapCount", {"CurrentLap": 20}, 2.0)


def stint(car: str, index: int, **fields: Any) -> dict[str, Any]:
    return {"Lines": {car: {"Stints": {str(index): fields}}}}


def fitted(events: list[Event]) -> list[tuple[Any, ...]]:
    return [(e.car, e.stint, e.compound, e.new, e.laps_before) for e in only(TyreFitted, events)]


def control(text: str, index: int = 0) -> tuple[str, Any, float]:
    return "RaceControlMessages", {"Messages": {str(index): {"Message": text}}}, 100.0 + index


@pytest.mark.parametrize(
    ("kind", "name", "expected"),
    [
        ("Race", "Race", "race"),
        ("Race", "Sprint", "sprint"),
        ("Qualifying", "Qualifying", "qualifying"),
        ("Qualifying", "Sprint Qualifying", "qualifying"),
        ("Practice", "Practice 1", "practice"),
    ],
)
def test_the_kind_of_session(kind: str, name: str, expected: str) -> None:
    (session,) = events_of(("SessionInfo", INFO | {"Type": kind, "Name": name}, 0.0))
    assert session == Session(0.0, expected, "São Paulo Grand Prix", 2025)  # type: ignore[arg-type]


def test_qualifying_is_told_by_its_timing_where_the_session_is_not_named() -> None:
    events = events_of(("TimingData", {"SessionPart": 1, "NoEntries": [20, 15, 10], "Lines": {"4": {"Position": "1"}}}, 0.0))
    assert only(Session, events)[0].kind == "qualifying"


def test_the_same_session_told_again_is_no_new_one_and_another_forgets_all() -> None:
    events = race_events(("SessionInfo", INFO | {"SessionStatus": "Finalised"}, 5.0), ("TimingData", timing(c4={"NumberOfLaps": 3}), 6.0))
    assert not only(Session, events)
    events = race_events(
        ("TimingData", timing(c4={"NumberOfLaps": 1}), 6.0),
        ("SessionInfo", INFO | {"Key": 2, "Name": "Sprint"}, 9.0),
        ("TimingData", timing(c4={"NumberOfLaps": 1}), 99.0),
    )
    assert [type(event).__name__ for event in events] == ["LapCompleted", "Session", "Entry", "LapCompleted"]


def test_a_late_join_without_a_snapshot_begins_a_session_that_is_named_later() -> None:
    events = events_of(
        ("Heartbeat", {"Utc": "2025-11-08T14:20:21Z"}, 0.0),
        ("TimingData", timing(c4={"NumberOfLaps": 8, "LastLapTime": {"Value": "24:14.149"}}), 5.0),
        ("SessionInfo", INFO, 6.0),
    )
    assert [type(event).__name__ for event in events] == ["Session", "Heartbeat", "Entry", "LapCompleted"]
    assert only(Session, events)[0].event == ""
    assert only(Entry, events)[0].driver == "NOR", "4 was Norris in 2025"
    assert only(LapCompleted, events)[0] == LapCompleted(5.0, 4, 8, 24 * 60 + 14.149)


def test_a_session_that_has_not_begun_is_another_one_though_the_first_was_never_named() -> None:
    events = events_of(
        ("TimingData", timing(c4={"NumberOfLaps": 8}), 5.0),
        ("SessionInfo", INFO | {"SessionStatus": "Inactive"}, 999.0),
        ("TimingData", timing(c4={"NumberOfLaps": 1}), 2000.0),
    )
    assert [session.event for session in only(Session, events)] == ["", "São Paulo Grand Prix"]
    assert [lap.lap for lap in only(LapCompleted, events)] == [8, 1]


def test_a_season_that_the_feed_does_not_say_can_be_given() -> None:
    feed = LiveTiming(Anomalies(), season=2023)
    events = feed.events(Message("TimingData", timing(c1={}), 0.0))
    assert events == [Session(0.0, "race", "", 2023), Entry(0.0, 1, "VER")]
    assert events_of(("TimingData", timing(c1={}), 0.0))[1] == Entry(0.0, 1, "1"), "the champion's number is nobody's without a season"


def test_laps_of_a_snapshot_were_not_seen_at_the_line() -> None:
    events = race_events(ON_LAP_20, ("TimingData", timing(c4={"NumberOfLaps": 7, "LastLapTime": {"Value": "1:13.5"}}), 5.0, True))
    assert only(LapCompleted, events) == [LapCompleted(5.0, 4, 7, 73.5, at_line=False)]


def test_drivers_of_a_support_race_have_no_entry_and_take_no_number() -> None:
    faults = Anomalies()
    later = {"4": {"Tla": "FOR", "TeamName": "Rodin"}, "61": {"Tla": "DOO", "TeamName": "Virtuosi"}}
    events = race_events(("DriverList", later, 5.0), ("TimingData", timing(c4={"Position": "2"}), 6.0), anomalies=faults)
    assert not only(Entry, events)
    assert faults.counts == {"another driver for a number": 1}


def test_a_car_has_the_driver_of_the_list_whatever_its_number_was_before_2026() -> None:
    info = INFO | {"StartDate": "2026-03-15T15:00:00"}
    drivers = {"1": {"Tla": "NOR"}, "3": {"Tla": "VER"}, "41": {"Tla": "LIN"}}
    events = events_of(
        ("SessionInfo", info, 0.0), ("DriverList", drivers, 0.0), ("TimingData", timing(c1={}, c3={}, c41={}, c43={}, c98={}), 1.0)
    )
    assert [entry.driver for entry in only(Entry, events)] == ["NOR", "VER", "LIN", "COL", "98"]


def test_an_entry_is_told_again_when_more_is_known() -> None:
    events = race_events(("TimingAppData", {"Lines": {"4": {"GridPos": "3"}, "1": {"GridPos": "0"}}}, 2.0))
    assert events == [Entry(2.0, 4, "NOR", "McLaren", 3)]


def test_more_cars_than_a_race_has_are_left_out() -> None:
    faults = Anomalies()
    events = events_of(
        ("TimingData", {"Lines": {str(n): {"Position": "1"} for n in range(1, 31)} | {"x": {}, "5": 1}}, 0.0), anomalies=faults
    )
    assert len(only(Entry, events)) == 24
    assert faults.counts == {"more cars than a race has": 5, "no line of a car": 2}  # 1 to 30 without 5


def test_gaps_in_laps_seconds_and_nothing() -> None:
    gap, ahead = "GapToLeader", "IntervalToPositionAhead"
    events = race_events(
        ("TimingData", timing(c1={gap: "LAP 23", ahead: {"Value": "LAP 23"}}, c4={gap: "+1.250", ahead: {"Value": "+1.250"}}), 5.0),
        ("TimingData", timing(c4={gap: "+1.250", ahead: {"Catching": True}}), 6.0),
        ("TimingData", timing(c4={gap: "1L", ahead: {"Value": "+4.5"}}), 7.0),
        ("TimingData", timing(c4={gap: "", ahead: {"Value": ""}}), 8.0),
        ("TimingData", timing(c4={gap: None, ahead: None}), 9.0),
    )
    assert events == [Gap(5.0, 1, 0.0, 0), Gap(5.0, 4, 1.25, 0, 1.25), Gap(7.0, 4, None, 1, 4.5), Gap(8.0, 4)]


def test_a_lap_time_may_come_before_its_lap_or_after_it() -> None:
    events = race_events(
        ON_LAP_20,
        ("TimingData", timing(c4={"NumberOfLaps": 1}), 100.0),
        ("TimingData", timing(c4={"LastLapTime": {"Value": "1:30.100"}}), 190.2),
        ("TimingData", timing(c4={"NumberOfLaps": 2}), 190.6),
        ("TimingData", timing(c4={"LastLapTime": {"Value": "1:30.100"}}), 190.7),
        ("TimingData", timing(c4={"NumberOfLaps": 3}), 280.4),
        ("TimingData", timing(c4={"LastLapTime": {"Value": "1:30.200"}}), 280.5),
    )
    laps = [(lap.lap, lap.lap_time_s, round(lap.time_s, 3)) for lap in only(LapCompleted, events)]
    assert laps == [(1, None, 100.0), (2, 90.1, 190.1), (3, None, 280.4), (3, 90.2, 280.3)]


def test_a_lap_that_is_told_late_ended_when_its_lap_time_says() -> None:
    first = ("TimingData", timing(c4={"NumberOfLaps": 1}), 100.0)
    late = ("TimingData", timing(c4={"NumberOfLaps": 2, "LastLapTime": {"Value": "1:30.0"}}), 229.7)
    assert only(LapCompleted, race_events(ON_LAP_20, first, late))[-1].time_s == 190.0
    later = ("TimingData", timing(c4={"NumberOfLaps": 4, "LastLapTime": {"Value": "1:30.0"}}), 229.7)
    assert only(LapCompleted, race_events(ON_LAP_20, first, later))[-1].time_s == 229.7, "laps 2 and 3 were never told"


def test_repeats_tell_nothing_and_a_count_back_or_ahead_of_the_leader_is_a_fault() -> None:
    faults = Anomalies()
    line = ("TimingData", timing(c4={"NumberOfLaps": 2, "Position": "3", "InPit": False, "GapToLeader": "+1.0"}), 9.0)
    wrong = [("TimingData", timing(c4={"NumberOfLaps": laps}), 10.0) for laps in (1, 70, "x", True, 1000, -1)]
    events = race_events(line, line, *wrong, anomalies=faults)
    assert [type(event).__name__ for event in events] == ["LapCompleted", "Position", "Gap"]
    assert faults.counts == {"laps counted back": 1, "laps ahead of the leader": 1}


def test_laps_to_the_grid_and_the_way_home_are_no_visits_to_the_pit_lane() -> None:
    before = [("TimingData", timing(c4=line), 1.0) for line in ({"InPit": True}, {"InPit": False, "PitOut": True}, {"PitOut": False})]
    assert not only(PitIn, events_of(*before)) + only(PitOut, events_of(*before))
    events = race_events(
        ("SessionStatus", {"Status": "Finished"}, 5.0),
        ("TimingData", timing(c4={"NumberOfLaps": 2}), 6.0),
        ("TimingData", timing(c4={"InPit": True}), 9.0),
        ("TimingData", timing(c4={"Stopped": True}), 9.0),
        ("SessionStatus", {"Status": "Finalised"}, 99.0),
        ("SessionStatus", {"Status": "Ends"}, 999.0),
    )
    assert events == [LapCompleted(6.0, 4, 2), SessionOver(99.0)]


def test_a_stop_ends_one_lap_and_begins_the_next() -> None:
    events = race_events(
        ("TimingData", timing(c4={"InPit": True, "NumberOfPitStops": 1}), 95.0),
        ("TimingData", timing(c4={"NumberOfLaps": 1}), 100.0),
        ("TimingData", timing(c4={"InPit": True}), 105.0),
        ("TimingData", timing(c4={"InPit": False, "PitOut": True}), 120.0),
        ("TimingData", timing(c4={"PitOut": False}), 150.0),
    )
    assert events == [PitIn(95.0, 4, 1), LapCompleted(100.0, 4, 1), PitOut(120.0, 4, 2)]


def test_a_car_seen_first_as_it_leaves_the_pit_lane_leaves_it() -> None:
    events = events_of(
        ("SessionData", {"StatusSeries": {"10": {"SessionStatus": "Started"}}}, 1.0),
        ("TimingData", timing(c4={"InPit": False, "PitOut": True}), 2.0),
    )
    assert only(PitOut, events) == [PitOut(2.0, 4)]


def test_a_stopped_car_is_out_and_may_be_taken_back() -> None:
    events = race_events(
        ("TimingData", timing(c4={"Stopped": True}), 5.0),
        ("TimingData", timing(c4={"Retired": True}), 6.0),
        ("TimingData", timing(c4={"Stopped": False}), 7.0),
        ("TimingData", timing(c4={"Retired": False}), 8.0),
    )
    assert events == [Retired(5.0, 4), Retired(8.0, 4, out=False)]


def test_a_stint_is_corrected_later_and_laps_on_it_are_no_news() -> None:
    events = race_events(
        ("TimingAppData", {"Lines": {"4": {"Stints": []}}}, 1.0),
        (
            "TimingAppData",
            {"Lines": {"4": {"Stints": [{"Compound": "UNKNOWN", "New": "false", "TyresNotChanged": "0", "StartLaps": 0}]}}},
            2.0,
        ),
        ("TimingAppData", stint("4", 0, TotalLaps=3), 3.0),
        ("TimingAppData", stint("4", 0, Compound="MEDIUM", New="true"), 4.0),
        ("TimingAppData", stint("4", 0, Compound=None), 5.0),
        ("TimingAppData", stint("4", 0, Compound="HARD"), 6.0),
    )
    assert fitted(events) == [(4, 1, None, False, 0), (4, 1, "M", True, 0), (4, 1, None, True, 0), (4, 1, "H", True, 0)]


def test_stints_of_a_snapshot_were_fitted_after_the_laps_on_those_before() -> None:
    laps = [
        {"Compound": "SOFT", "StartLaps": 2, "TotalLaps": 16},
        {"Compound": "HARD", "StartLaps": 0, "TotalLaps": 20},
        {"Compound": "SOFT"},
    ]
    events = race_events(("TimingAppData", {"Lines": {"4": {"Stints": laps}}}, 2.0, True))
    assert [event.fitted_lap for event in only(TyreFitted, events)] == [0, 14, 34]
    later = race_events(("TimingAppData", stint("4", 1, Compound="HARD"), 2.0))
    assert [event.fitted_lap for event in only(TyreFitted, later)] == [None], "now"


def test_a_visit_without_a_change_of_tyres_is_no_stint_until_the_feed_says_otherwise() -> None:
    events = race_events(
        ("TimingAppData", stint("4", 1, Compound="SOFT", New="true", TyresNotChanged="1", TotalLaps=1, StartLaps=0), 2.0),
        ("TimingAppData", stint("4", 1, TyresNotChanged="0", Compound="MEDIUM"), 3.0),
    )
    assert fitted(events) == [(4, 2, "M", True, 0)]


def test_compounds_of_2018_are_ranked_once_three_are_known() -> None:
    info = INFO | {"StartDate": "2018-04-29T16:10:00"}
    said = [("TimingAppData", stint(car, 0, Compound=name), 1.0) for car, name in (("5", "SUPERSOFT"), ("7", "ULTRASOFT"), ("9", "SOFT"))]
    events = events_of(("SessionInfo", info, 0.0), *said)
    assert [(car, letter) for car, _, letter, _, _ in fitted(events)] == [(5, None), (7, None), (9, "H"), (5, "M"), (7, "S")]
    fourth = events_of(("SessionInfo", info, 0.0), *said, ("TimingAppData", stint("3", 0, Compound="HARD"), 2.0))
    assert [letter for _, _, letter, _, _ in fitted(fourth)][5:] == [None] * 4


def test_the_track_status_is_told_when_it_changes_and_yellow_flags_are_green() -> None:
    faults = Anomalies()
    digits = ["1", "2", "1", "4", "4", "6", "7", "5", "1", "3", "9", None]
    events = race_events(*[("TrackStatus", {"Status": digit}, float(i)) for i, digit in enumerate(digits)], anomalies=faults)
    assert [(event.time_s, event.status) for event in only(StatusChanged, events)] == [(0, GREEN), (3, SC), (5, VSC), (7, RED), (8, GREEN)]
    assert faults.counts == {"unknown track status": 3}


def test_session_data_tells_the_status_only_where_its_own_topic_is_missing() -> None:
    red = ("SessionData", {"StatusSeries": [{"TrackStatus": "Red"}]}, 2.0)
    assert only(StatusChanged, race_events(red)) == [StatusChanged(2.0, RED)]
    assert only(StatusChanged, race_events(("TrackStatus", {"Status": "1"}, 1.0), red)) == [StatusChanged(1.0, GREEN)]


def test_safety_car_in_this_lap_is_an_announcement() -> None:
    events = race_events(("TrackStatus", {"Status": "4"}, 1.0), control("SAFETY CAR IN THIS LAP"), control("VIRTUAL SAFETY CAR ENDING", 1))
    assert [event.status for event in only(StatusChanged, events)] == [SC]
    assert [event.topic for event in only(RaceControl, events)] == ["safety car in", "vsc ending"]


@pytest.mark.parametrize(
    ("text", "enabled"),
    [
        ("DRS ENABLED", True),
        ("DRS DISABLED", False),
        ("OVERTAKE ENABLED", True),
        ("OVERTAKE DISABLED", False),
        ("DRS DISABLED IN ZONE 2", None),
    ],
)
def test_drs_and_the_overtake_mode_follow_race_control(text: str, enabled: bool | None) -> None:
    events = race_events(control(text), control(text))
    assert [aid.enabled for aid in only(OvertakeAid, events)] == ([] if enabled is None else [enabled])
    assert len(only(RaceControl, events)) == 1, "a message told again is no new one"


@pytest.mark.parametrize(
    ("text", "topic", "car", "seconds"),
    [
        ("FIA STEWARDS: 5 SECOND TIME PENALTY FOR CAR 4 (NOR) - FALSE START", "time penalty", 4, 5.0),
        ("FIA STEWARDS: PENALTY SERVED - 10 SECOND TIME PENALTY FOR CAR 31 (OCO) - CAUSING A COLLISION", "penalty served", 31, 10.0),
        ("FIA STEWARDS: DRIVE THROUGH PENALTY FOR CAR 14 (ALO) - SPEEDING", "drive-through", 14, None),
        ("FIA STEWARDS: 10 SECOND STOP/GO PENALTY FOR CAR 20 (MAG)", "stop and go", 20, 10.0),
        ("FIA STEWARDS: INCIDENT INVOLVING CAR 7 (DOO) UNDER INVESTIGATION - TRACK LIMITS", "note", 7, None),
        ("TURN 4 INCIDENT INVOLVING CARS 30 (LAW) AND 87 (BEA) NOTED", "note", None, None),
        ("CAR 63 (RUS) DISQUALIFIED", "disqualified", 63, None),
        (" safety  car in this lap ", "safety car in", None, None),
    ],
)
def test_what_a_message_of_race_control_is_about(text: str, topic: str, car: int | None, seconds: float | None) -> None:
    (event,) = only(RaceControl, race_events(control(text)))
    assert (event.topic, event.car, event.seconds) == (topic, car, seconds)


def test_laps_of_the_leader_and_the_distance() -> None:
    events = race_events(
        ("LapCount", {"CurrentLap": 2}, 5.0),
        ("SessionData", {"Series": {"1": {"Lap": 2}, "2": {"Lap": 3}}}, 6.0),
        ("LapCount", {"TotalLaps": 70}, 7.0),
    )
    assert events == [LapCount(5.0, 2, 71), LapCount(6.0, 3, 71), LapCount(7.0, 3, 70)]


def test_weather_is_told_when_it_changes() -> None:
    said = ("WeatherData", {"AirTemp": "23.4", "TrackTemp": "28.0", "Rainfall": "0"}, 1.0)
    events = race_events(said, said, ("WeatherData", {"Rainfall": "1", "AirTemp": "warm"}, 2.0))
    assert events == [Weather(1.0, 23.4, 28.0, False), Weather(2.0, 23.4, 28.0, True)]


@pytest.mark.parametrize(
    "topic",
    [
        "SessionInfo",
        "SessionStatus",
        "SessionData",
        "LapCount",
        "DriverList",
        "TrackStatus",
        "TimingData",
        "TimingAppData",
        "RaceControlMessages",
        "WeatherData",
    ],
)
@pytest.mark.parametrize("value", [None, "x", [], [1], {"4": 1}, {"4": {"Stints": 5, "Sectors": 1}}, [[[]]]])
def test_values_of_another_kind_change_nothing(topic: str, value: Any) -> None:
    keys = ("Lines", "Messages", "Series", "StatusSeries", "Status", "CurrentLap", "TotalLaps", "4", "Type", "AirTemp")
    events = race_events((topic, dict.fromkeys(keys, value), 5.0))
    assert not [event for event in events if not isinstance(event, Entry)]


def test_a_time_of_day_that_leaps_is_not_believed_until_the_next_agrees() -> None:
    faults = Anomalies()
    stamps = [None, 1e9, 1e9 + 2, 1e9 - 1, 5e9, 1e9 + 3, None, 2e9, 2e9 + 1]
    clock = [message.stamp_s for message in session_clock((Message("Heartbeat", {}, stamp) for stamp in stamps), faults)]
    assert clock == [0, 0, 2, -1, -1, 3, 3, 3, 3]
    assert faults.counts == {"time of day leaps": 2}
    assert [message.stamp_s for message in session_clock([Message("Heartbeat", {}, None)], faults)] == [0]
    assert [message.stamp_s for message in session_clock([Message("Heartbeat", {}, 70.5)], faults)] == [70.5], "an archive's own clock"


def test_anomalies_are_counted_with_few_examples() -> None:
    faults = Anomalies()
    assert [faults.add("bad line", f"line {i} " + "x" * 1000) for i in range(100)] == [True] + [False] * 99
    faults.add("clock")
    assert faults.summary() == "bad line 100, clock 1"
    assert len(faults.examples) == MOST_EXAMPLES + 1, "the first of each kind is kept"
    assert max(map(len, faults.examples)) < 140


def test_positions_of_cars() -> None:
    assert race_events(("TimingData", timing(c4={"Position": "2", "Line": 3}, c1={"Position": "99"}), 5.0)) == [Position(5.0, 4, 2)]
    assert DRIVERS["4"]["Tla"] == "NOR"
