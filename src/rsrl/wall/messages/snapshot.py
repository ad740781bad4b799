"""The race as all viewers see it: the snapshot, sent whole on every update, and the history lap by lap. Both are the same for a simulated,
a replayed and a live race."""

from typing import Literal

from pydantic import Field

from rsrl.wall.messages.base import Driver, Marks, Message, Status, Strict


class Tyre(Strict):
    """A set on a car.

    Attributes:
        compound: S, M, H, I or W; None for unknown.
        age_laps: laps that it has run, those before the race included.
        new: whether it was new when it was fitted.
    """

    compound: str | None
    age_laps: int | None
    new: bool | None = None


class StintBar(Strict):
    """A stint of a car: laps `first_lap` to `last_lap`, the last of which is still under way for a set on the car."""

    compound: str | None
    first_lap: int
    last_lap: int
    laps_before: int | None = None


class TowerRow(Strict):
    """A car as it stood when it last crossed the line.

    Attributes:
        position: 1 is the leader; cars that are out come last.
        gap_to_leader_s, interval_s: at the car's last crossing, in time; None for the leader, or where it is unknown.
        laps_down: whole laps behind the leader.
        laps: completed. last_lap_s, best_lap_s: lap times.
        sets_left: of soft, medium and hard, the fitted one not included; None where nobody knows.
        pit: in the pit lane, or has just left it.
        penalty_s: time penalties not yet served.
        note: what race control last said of the car that bears on strategy.
        out: retired, disqualified or never started.
        marks: of this row's figures that are not from where those of the column are.
    """

    position: int
    driver: Driver
    gap_to_leader_s: float | None
    interval_s: float | None
    laps_down: int
    laps: int
    last_lap_s: float | None
    best_lap_s: float | None
    tyre: Tyre
    stops: int
    sets_left: tuple[int, int, int] | None
    pit: Literal["", "in", "out"] = ""
    penalty_s: float = 0.0
    note: str = ""
    out: bool = False
    stints: tuple[StintBar, ...]
    marks: Marks = Field(default_factory=dict)


class RaceControlMessage(Strict):
    """A message of race control; `time_s` on the session clock."""

    time_s: float
    lap: int
    text: str
    topic: str
    driver: Driver | None = None


class WeatherNow(Strict):
    """Air and track temperature, and whether it rains; None where unknown."""

    air_c: float | None
    track_c: float | None
    rain: bool | None


class Race(Message):
    """The race at one moment, the same for all viewers of a session.

    Attributes:
        session: which session it is of.
        sequence: number of the update within the session; a later one has a larger number.
        time_s: session clock; 0 at the start of the race.
        lap: lap of the leader, from 1; total_laps at the flag.
        status, status_laps: track status, and laps of the leader since it began.
        finished: the flag is out and all cars have taken it.
        tower: by position.
        messages: of race control, the newest last, at most 40.
        age_s: how long ago the source last said anything of a car on the track.
        marks: by path, such as `tower.gap_to_leader_s`.
    """

    type: Literal["race"] = "race"
    session: str
    sequence: int
    time_s: float
    lap: int
    total_laps: int | None
    status: Status
    status_laps: int
    finished: bool
    tower: tuple[TowerRow, ...]
    messages: tuple[RaceControlMessage, ...]
    weather: WeatherNow | None
    age_s: float
    marks: Marks


class LapOfCar(Strict):
    """A lap of a car: time, gap to the leader at its end in time, place, and whether the car boxed at its end."""

    driver: Driver
    lap_time_s: float | None
    gap_to_leader_s: float | None
    position: int
    boxed: bool


class LapOfRace(Strict):
    """A lap of the race: the status under which the leaders drove most of it, the field's mean lap, and the cars.

    Attributes:
        mean_lap_s: mean of the lap times of cars that neither boxed nor left the pit lane on the lap; None without any.
    """

    lap: int
    status: Status
    mean_lap_s: float | None
    cars: tuple[LapOfCar, ...]


class History(Message):
    """Laps that all running cars on the lead lap have completed, or that are complete otherwise.

    A viewer gets all of them at first (`whole`), which replaces what it has, after a seek as well; later only the new ones.
    """

    type: Literal["history"] = "history"
    session: str
    whole: bool
    laps: tuple[LapOfRace, ...]
    marks: Marks
