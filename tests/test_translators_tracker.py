"""The race tracker with what real feeds do: late joins, repeats, disorder, corrections, silence, cars that never start."""

from collections.abc import Iterable, Iterator

import pytest
from synthetic_race import synthetic_race

from rsrl.feeds import (
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
    SetsLeft,
    StatusChanged,
    TyreFitted,
)
from rsrl.season import GREEN, RED, SC, VSC, RaceRecord
from rsrl.translators import RaceTracker, Tracked, TrackedStates

RECORD = synthetic_race(laps=30, cars=6)
LAP_S, APART_S = 90.0, 2.0
OWN = 4  # car number of C03


def opening(record: RaceRecord = RECORD, cars: int = 6) -> Iterator[Event]:
    yield Session(0.0, "race", record.event, record.season, record.laps)
    for car in range(1, cars + 1):
        yield Entry(0.0, car, f"C{car - 1:02d}", grid=car)
        yield TyreFitted(0.0, car, 1, "M", True, 0)
    yield LapCount(100.0, 1, record.laps)


def crossing(car: int, lap: int) -> float:
    return 100.0 + LAP_S * lap + APART_S * (car - 1)


def laps(first: int, last: int, cars: Iterable[int] = range(1, 7)) -> Iterator[Event]:
    """Laps of cars two seconds apart, in order of time."""
    for lap in range(first, last + 1):
        for car in sorted(cars):
            yield LapCompleted(crossing(car, lap), car, lap, LAP_S)


def tracked(events: Iterable[Event], record: RaceRecord = RECORD) -> tuple[RaceTracker, TrackedStates]:
    tracker = RaceTracker()
    states = TrackedStates(record, tracker)
    for event in events:
        states.note(tracker.take(event))
    return tracker, states


def state_after(*events: Iterable[Event], car: int = OWN) -> Tracked:
    return tracked([event for part in events for event in part])[1].state(car)


def test_a_plain_race() -> None:
    found = state_after(opening(), list(laps(1, 8))[:-2])
    assert found.state is not None
    own = next(c for c in found.state.cars if c.driver == "C03")
    assert (found.state.laps_completed, own.position) == (8, 4)
    assert own.gap_to_leader_s == pytest.approx(6.0)
    assert (own.compound, own.tyre_age_laps, own.worn_laps, own.stops, own.last_lap_s) == ("M", 8, 8.0, 0, LAP_S)
    assert found.state.sets_left == (2, 1, 2)
    assert found.state.previous_gap_ahead_s == pytest.approx(2.0)
    assert found.health.gaps == {"measured": 4, "projected": 2}  # the cars behind have not crossed the line yet
    assert [c.driver for c in found.state.cars] == ["C00", "C01", "C02", "C03", "C04", "C05"]
    assert (found.health.fields["compound"], found.health.fields["sets_left"]) == ("measured", "derived")


def test_repeats_and_disorder_change_nothing() -> None:
    events = list(laps(1, 8))
    shuffled = [e for pair in zip(events[1::2], events[::2], strict=True) for e in (*pair, pair[0])]
    plain, other = state_after(opening(), events), state_after(opening(), shuffled)
    assert plain.state is not None
    assert other.state is not None
    for a, b in zip(plain.state.cars, other.state.cars, strict=True):
        assert (a.driver, a.position, a.tyre_age_laps, a.worn_laps) == (b.driver, b.position, b.tyre_age_laps, b.worn_laps)


def test_before_the_start_the_field_stands_on_its_grid() -> None:
    found = state_after(opening())
    assert found.state is not None
    assert (found.state.laps_completed, found.state.previous_gap_ahead_s) == (0, 0.0)
    assert [c.position for c in found.state.cars] == [1, 2, 3, 4, 5, 6]


def test_a_late_join_has_counts_and_gaps_before_it_has_crossings() -> None:
    snapshot: list[Event] = [Session(900.0, "race", RECORD.event, RECORD.season)]
    for car in range(1, 7):
        snapshot += [Entry(900.0, car, f"C{car - 1:02d}"), Position(900.0, car, car)]
        snapshot += [TyreFitted(900.0, car, 1, "S", True, 0, 0), TyreFitted(900.0, car, 2, "H", True, 0, 3)]
        snapshot += [LapCompleted(900.0, car, 8, None, at_line=False), Gap(900.0, car, 2.0 * (car - 1), 0, 2.0)]
    snapshot.append(LapCount(900.0, 9, RECORD.laps))
    assert state_after(snapshot).reason == "no crossing of the line is known yet"
    found = state_after(snapshot, [LapCompleted(crossing(car, 9), car, 9, LAP_S) for car in range(1, 5)])
    assert found.state is not None
    assert [round(c.gap_to_leader_s or 0.0) for c in found.state.cars] == [0, 2, 4, 6, 8, 10]
    own = next(c for c in found.state.cars if c.driver == "C03")
    assert (own.stops, own.compound, own.tyre_age_laps, found.state.compounds_used) == (1, "H", 6, frozenset("SH"))
    assert found.health.gaps == {"measured": 4, "stated": 2}


def test_a_stint_corrected_later_counts_as_corrected() -> None:
    stop: list[Event] = [
        PitIn(crossing(OWN, 5) - 2, OWN, 5),
        PitOut(crossing(OWN, 5) + 20, OWN, 6),
        TyreFitted(crossing(OWN, 5) + 25, OWN, 2, "S", True, 0),
    ]
    wrong = state_after(opening(), laps(1, 5), stop, laps(6, 9))
    right = state_after(opening(), laps(1, 5), stop, laps(6, 9), [TyreFitted(crossing(6, 9), OWN, 2, "H", False, 3)])
    assert wrong.state is not None
    assert right.state is not None
    own = next(c for c in right.state.cars if c.driver == "C03")
    assert (own.compound, own.tyre_age_laps, own.stops) == ("H", 3 + 4, 1)
    assert (wrong.state.sets_left, right.state.sets_left) == ((1, 1, 2), (2, 1, 1))
    assert right.state.compounds_used == {"M", "H"}


def test_a_rival_that_boxes_on_the_lap_under_way_has_lost_the_stop_at_once() -> None:
    events = [*opening(), *laps(1, 8), PitIn(crossing(1, 9) - 3, 1, 9)]
    _, states = tracked(events)
    found, before = states.state(OWN), states.state(OWN, under_way=False)
    assert found.state is not None
    assert before.state is not None
    rival = next(c for c in found.state.cars if c.driver == "C00")
    assert (rival.just_stopped, rival.stops, rival.tyre_age_laps, rival.position) == (True, 1, 0, 6)
    assert before.state.cars[0].driver == "C00"
    assert found.health.missing == ("compound of C00: the one fitted most often is assumed",)


def test_status_and_its_laps() -> None:
    out = StatusChanged(crossing(1, 8) + 30, SC)
    found = state_after(opening(), laps(1, 8), [out])
    assert found.state is not None
    assert (found.state.track_status, found.state.status_laps) == (SC, 0)
    later = state_after(opening(), laps(1, 8), [out], laps(9, 11))
    assert later.state is not None
    assert (later.state.track_status, later.state.status_laps) == (SC, 3)
    own = next(c for c in later.state.cars if c.driver == "C03")
    assert own.tyre_age_laps == 11
    slow = RECORD.incidents.sc_wear_factor.value
    assert own.worn_laps == pytest.approx(8 + 3 * slow)


@pytest.mark.parametrize("status", [VSC, SC, RED])
def test_a_status_that_ends_leaves_green(status: int) -> None:
    spans: list[Event] = [StatusChanged(crossing(6, 8) + 1, status), StatusChanged(crossing(6, 8) + 20, GREEN)]
    found = state_after(opening(), laps(1, 8), spans, laps(9, 10))
    assert found.state is not None
    assert found.state.track_status == GREEN


def test_after_a_red_flag_the_field_stands_in_a_queue() -> None:
    red: list[Event] = [StatusChanged(crossing(6, 8) + 20, RED)]
    late = [LapCompleted(e.time_s + 1200.0 * (e.car > 3), e.car, 9, 1290.0) for e in laps(9, 9) if isinstance(e, LapCompleted)]
    found = state_after(opening(), laps(1, 8), red, [Position(900.0, car, car) for car in range(1, 7)], late)
    assert found.state is not None
    gap = RECORD.incidents.sc_gap_s.value
    assert [c.gap_to_leader_s for c in found.state.cars] == pytest.approx([gap * place for place in range(6)])
    own = next(c for c in found.state.cars if c.driver == "C03")
    assert own.last_lap_s < 2 * RECORD.track.base_lap_s.value


def test_a_car_that_never_starts_is_out_though_a_lap_of_it_is_listed() -> None:
    phantom: list[Event] = [LapCompleted(crossing(6, 1), 6, 1, None)]
    found = state_after(opening(), laps(1, 1, range(1, 6)), phantom, laps(2, 6, range(1, 6)))
    assert found.state is not None
    assert [c.driver for c in found.state.cars if not c.running] == ["C05"]
    assert found.health.unheard == ("C05",)
    again = state_after(opening(), laps(1, 1), laps(2, 6, range(1, 6)), laps(7, 7))
    assert again.state is not None
    assert all(c.running for c in again.state.cars)  # heard of again: it was repaired


def test_a_car_without_transponder_keeps_its_stated_place() -> None:
    events: list[Event] = []
    for event in laps(1, 6, [1, 2, 4, 5, 6]):
        events += [event, Position(event.time_s, 3, 3)]
    found = state_after(opening(), events)
    assert found.state is not None
    third = next(c for c in found.state.cars if c.driver == "C02")
    assert (third.running, third.position) == (True, 3)
    assert "crossings of C02: gap or place as stated" in found.health.missing


def stop_of(car: int, lap: int, told: bool, lane_s: float = 22.0) -> list[Event]:
    events: list[Event] = [PitIn(crossing(car, lap) - 2, car, lap), PitOut(crossing(car, lap) - 2 + lane_s, car, lap + 1)]
    return [*events, TyreFitted(events[1].time_s, car, 2, "H", True, 0)] if told else events


def in_order(*parts: Iterable[Event]) -> list[Event]:
    return sorted((e for part in parts for e in part), key=lambda e: e.time_s)


def test_a_stop_that_the_tyre_record_misses_is_told_from_its_time_in_the_pit_lane() -> None:
    stops = [e for car in (1, 2, 3) for e in stop_of(car, 5, told=True)]
    usual, quick = stop_of(OWN, 7, told=False), stop_of(5, 7, told=False, lane_s=14.0)
    tracker, states = tracked(in_order(opening(), laps(1, 9), stops, usual, quick))
    assert [(s.fitted_lap, s.compound, s.told) for s in tracker.cars[OWN].stints] == [(0, "M", True), (7, None, False)]
    assert len(tracker.cars[5].stints) == 1  # driven through
    assert states.state(OWN).reason == "the tyre fitted is unknown"
    other = states.state(5)
    assert other.state is not None
    rival = next(c for c in other.state.cars if c.driver == "C03")
    assert (rival.compound, rival.tyre_age_laps, rival.stops) == ("H", 2, 1)  # what the others fitted is assumed
    assert "compound of C03: the one fitted most often is assumed" in other.health.missing


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        (TyreFitted(900.0, OWN, 2, None), "the tyre fitted is unknown"),
        (TyreFitted(900.0, 2, 2, "I"), "intermediates or wets are in use, and there is no wet-weather model"),
        (Retired(900.0, OWN), "C03 is out of the race"),
        (RaceControl(900.0, "CAR 4 DISQUALIFIED", "disqualified", OWN), "C03 is out of the race"),
        (PitIn(900.0, OWN, 9), "in the pit lane"),
    ],
    ids=lambda value: value if isinstance(value, str) else type(value).__name__,
)
def test_where_there_is_no_call_the_reason_is_said(event: Event, reason: str) -> None:
    found = state_after(opening(), laps(1, 8), [event])
    assert (found.state, found.reason) == (None, reason)


def test_a_qualifying_session_has_nothing_to_call() -> None:
    events = [Session(0.0, "qualifying", "x", 2099), *list(opening())[1:], *laps(1, 3)]
    assert state_after(events).reason == "a qualifying session: nothing to call"


def test_a_new_session_forgets_the_one_before() -> None:
    tracker, _ = tracked([*opening(), *laps(1, 8), Session(2000.0, "race", "x", 2099)])
    assert (tracker.cars, tracker.leader_laps, tracker.status) == ({}, 0, GREEN)


def test_penalties_are_kept_until_they_are_served() -> None:
    given = RaceControl(500.0, "5 SECOND TIME PENALTY FOR CAR 4", "time penalty", OWN, 5.0)
    tracker, _ = tracked([*opening(), given])
    assert tracker.cars[OWN].penalty_s == 5.0
    tracker, _ = tracked([*opening(), given, RaceControl(600.0, "PENALTY SERVED", "penalty served", OWN)])
    assert tracker.cars[OWN].penalty_s == 0.0


def test_sets_that_a_source_states_go_before_the_estimate() -> None:
    found = state_after(opening(), laps(1, 8), [SetsLeft(900.0, OWN, 1, 0, 1)])
    assert found.state is not None
    assert found.state.sets_left == (1, 0, 1)
    assert found.health.fields["sets_left"] == "measured"


def at_figures(quicker_s: float) -> list[Event]:
    """The leader's laps as the figures expect them, less `quicker_s`; the others stay two seconds apart behind it."""
    compound, track, events, time_s = RECORD.tyres["M"], RECORD.track, list[Event](), 100.0
    pace = RECORD.cars[0].pace_s.value
    for lap in range(1, 13):
        wear = lap - 1
        fuel_kg = track.fuel_start_kg.value * (RECORD.laps - lap + 0.5) / RECORD.laps
        tyre_s = wear * compound.wear_s_per_lap.value + wear**2 * compound.curvature_s_per_lap2.value
        lap_s = track.base_lap_s.value + pace + track.fuel_s_per_kg.value * fuel_kg + tyre_s - quicker_s
        time_s += lap_s
        events += [LapCompleted(time_s + APART_S * (car - 1), car, lap, lap_s) for car in range(1, 7)]
    return events


@pytest.mark.parametrize("quicker_s", [-0.5, 0.0, 0.5])
def test_form_is_learned_from_laps_that_show_it(quicker_s: float) -> None:
    found = state_after(opening(), at_figures(quicker_s), car=1)
    assert found.state is not None
    # Bayes' rule for the 11 laps after the first; a set's pace does not vary in this race, so all of it is form
    form, noise = RECORD.cars[0].form_sd_s.value ** 2, RECORD.track.lap_noise_sd_s.value**2
    assert found.state.cars[0].form_s == pytest.approx(-quicker_s * form / (form + noise / 11), abs=1e-3)


def test_the_aid_that_race_control_gives_goes_before_the_rule() -> None:
    """Half a second behind, the car ahead gives DRS: laps at the figures' pace with it show a slower car than without."""
    events: list[Event] = [
        e if not isinstance(e, LapCompleted) or e.car != 2 else LapCompleted(e.time_s - 1.2, 2, e.lap, e.lap_time_s)
        for e in at_figures(0.0)
    ]
    allowed, never = (state_after(opening(), [OvertakeAid(100.0, enabled=enabled)], events, car=2) for enabled in (True, False))
    assert allowed.state is not None
    assert never.state is not None
    forms = [next(c for c in found.state.cars if c.driver == "C01").form_s for found in (allowed, never) if found.state]
    assert forms[0] - forms[1] > 0.2  # of the 0.4 s that DRS gives


def test_cars_that_the_season_file_does_not_know_are_left_out_and_named() -> None:
    stranger: list[Event] = [Entry(0.0, 99, "XYZ"), TyreFitted(0.0, 99, 1, "M", True, 0)]
    found = state_after(opening(), stranger, laps(1, 3, [1, 2, 3, 4, 5, 6, 99]))
    assert found.state is not None
    assert "XYZ" not in {c.driver for c in found.state.cars}
    assert "not in the season file: XYZ, left out of the state" in found.health.missing
