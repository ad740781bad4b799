"""The canonical events of a race: what any source can say, in one vocabulary.

A reader turns a source into these events in the order in which they became known; the race tracker takes them from there. An event
states what the source says and nothing more: what is missing is None or not sent, and what follows from several events is the tracker's
work. Readers may repeat themselves. Every event carries `time_s`, the session clock in seconds; cars go by their number.

A reader sends `Session` first, and again where the source begins a new session: it makes the tracker forget the one before. An `Entry`
of each car comes before the first event of that car.
"""

from typing import Final, Literal

import msgspec

COMPOUND_LETTERS: Final = ("S", "M", "H", "I", "W")
"""Compounds of `TyreFitted`: soft, medium, hard, intermediate, wet. None stands for one that the source does not know."""


class FeedEvent(msgspec.Struct, frozen=True, gc=False, tag=True):
    """What all events have: `time_s`, the session clock, s."""

    time_s: float


class Session(FeedEvent, frozen=True, gc=False):
    """A session begins, or the source was joined.

    Attributes:
        event: name of the Grand Prix as the source writes it.
        total_laps: distance of a race or sprint; None where the source does not say, or says it later with `LapCount`.
    """

    kind: Literal["race", "sprint", "qualifying", "practice"]
    event: str
    season: int
    total_laps: int | None = None


class Entry(FeedEvent, frozen=True, gc=False):
    """A car of the session: driver code of three letters, and grid place from 1 where the source knows it (None: pit lane or unknown)."""

    car: int
    driver: str
    team: str | None = None
    grid: int | None = None


class LapCompleted(FeedEvent, frozen=True, gc=False):
    """A car has completed lap `lap`, counted from 1; the pit entry of an in-lap counts as its end where the source has it so.

    Attributes:
        lap_time_s: None where the source has no time, as on most first laps.
        at_line: `time_s` is the moment at which the car crossed the line. False where only the count is known, as in the snapshot of a
            late join.
    """

    car: int
    lap: int
    lap_time_s: float | None = None
    at_line: bool = True


class Gap(FeedEvent, frozen=True, gc=False):
    """Gaps as the source states them.

    Attributes:
        gap_to_leader_s: 0 for the leader; None where it is not given in seconds.
        laps_down: whole laps behind the leader, as in "1L" or "+1 LAP"; 0 for a car on the lead lap, None where unknown.
        interval_s: to the car ahead; None where it is not given in seconds.
    """

    car: int
    gap_to_leader_s: float | None = None
    laps_down: int | None = None
    interval_s: float | None = None


class Position(FeedEvent, frozen=True, gc=False):
    """Place of a car on the road, from 1."""

    car: int
    position: int


class StatusChanged(FeedEvent, frozen=True, gc=False):
    """The track status from now on: `rsrl.season.GREEN`, `VSC`, `SC` or `RED`. Yellow flags are green; "VSC ending" is still VSC."""

    status: int


class PitIn(FeedEvent, frozen=True, gc=False):
    """A car has entered the pit lane at the end of lap `lap`; None where the source does not count."""

    car: int
    lap: int | None = None


class PitOut(FeedEvent, frozen=True, gc=False):
    """A car has left the pit lane on lap `lap`; None where the source does not count."""

    car: int
    lap: int | None = None


class TyreFitted(FeedEvent, frozen=True, gc=False):
    """What the source says of the set of a stint; a later event for the same stint corrects an earlier one.

    A visit to the pit lane that the source marks as one without a change of tyres has no such event.

    Attributes:
        stint: number of the stint from 1, in the source's own count; 1 is the set of the start.
        compound: letter of `COMPOUND_LETTERS`, None for unknown.
        new: whether the set was new when fitted, None for unknown.
        laps_before: laps that the set had run when it was fitted, those before the race included; None for unknown.
        fitted_lap: laps that the car had completed when it was fitted, 0 for the set of the start; None for now, or unknown.
    """

    car: int
    stint: int
    compound: str | None = None
    new: bool | None = None
    laps_before: int | None = None
    fitted_lap: int | None = None


class SetsLeft(FeedEvent, frozen=True, gc=False):
    """Sets of dry tyres that a car still has, the fitted one not included; few sources know (the games do)."""

    car: int
    soft: int
    medium: int
    hard: int


class Retired(FeedEvent, frozen=True, gc=False):
    """A car is out of the race (`out`), or, taken back by the source, in it again."""

    car: int
    out: bool = True


class LapCount(FeedEvent, frozen=True, gc=False):
    """The leader is on lap `lap` of `total_laps` (None where unknown)."""

    lap: int
    total_laps: int | None = None


class OvertakeAid(FeedEvent, frozen=True, gc=False):
    """DRS or, from 2026, the overtake mode has been enabled or disabled by race control."""

    enabled: bool


class RaceControl(FeedEvent, frozen=True, gc=False):
    """A message of race control.

    Attributes:
        topic: what it is about, as far as it bears on strategy. "safety car in" and "vsc ending" announce the end of a neutralisation,
            they are not that end.
        car: the car concerned, None where the message is for all.
        seconds: of a time penalty.
    """

    text: str
    topic: Literal[
        "note", "safety car in", "vsc ending", "time penalty", "drive-through", "stop and go", "penalty served", "disqualified"
    ] = "note"
    car: int | None = None
    seconds: float | None = None


class Weather(FeedEvent, frozen=True, gc=False):
    """Air and track temperature, °C, and whether it rains; None where unknown."""

    air_c: float | None = None
    track_c: float | None = None
    rain: bool | None = None


class Heartbeat(FeedEvent, frozen=True, gc=False):
    """The source is alive: nothing has changed up to `time_s`.

    Attributes:
        on_track: the source has told of cars on the track. False where it has only said that it is there.
        silent_s: by the clock of whoever reads the source, nothing at all has come of it for so long.
    """

    on_track: bool = False
    silent_s: float = 0.0


class SessionOver(FeedEvent, frozen=True, gc=False):
    """The chequered flag has been shown to the last car, or the recording ends with the session closed."""


Event = (
    Session
    | Entry
    | LapCompleted
    | Gap
    | Position
    | StatusChanged
    | PitIn
    | PitOut
    | TyreFitted
    | SetsLeft
    | Retired
    | LapCount
    | OvertakeAid
    | RaceControl
    | Weather
    | Heartbeat
    | SessionOver
)
"""Any canonical event; tagged with its name when written as JSON."""
