"""What a viewer may say. Names are chosen from the lists of the welcome; there are no paths, and nothing else reaches the file system."""

from typing import Annotated, Final, Literal

from pydantic import Field, TypeAdapter

from rsrl.wall.messages.base import Call, Driver, Message
from rsrl.wall.messages.server import Method

MOST_DELAY_S: Final = 300.0
SLOWEST, FASTEST = 1.0, 200.0
MOST_SEED: Final = 2**32 - 1

Name = Annotated[str, Field(min_length=1, max_length=80)]
Request = Annotated[int, Field(ge=0, le=2**31 - 1)]


class Watch(Message):
    """What both ways of watching have in common: where to begin, so that one message restores a view after a reload or from a link.

    Attributes:
        lap: begin at the begin of this lap of the driver; time_s: or at this race time. By default at the start.
        speed, playing, delay_s: of the clock; by default as the server starts it, running, and no delay.
    """

    lap: Annotated[int, Field(ge=1, le=200)] | None = None
    time_s: Annotated[float, Field(ge=0.0, le=100_000.0)] = 0.0
    speed: Annotated[float, Field(ge=SLOWEST, le=FASTEST)] | None = None
    playing: bool = True
    delay_s: Annotated[float, Field(ge=0.0, le=MOST_DELAY_S)] = 0.0


class WatchSimulated(Watch):
    """Watch a simulated race, called by the policy for `driver` (None: the race's default driver)."""

    type: Literal["watch simulated"] = "watch simulated"
    race: Name
    driver: Driver | None = None
    seed: Annotated[int, Field(ge=0, le=MOST_SEED)] = 0


class WatchRecorded(Watch):
    """Watch a recorded race or a live source of the welcome's list, by its name there."""

    type: Literal["watch recorded"] = "watch recorded"
    name: Name
    race: Name
    driver: Driver | None = None


class ChooseDriver(Message):
    """Look at another car of the session; the clock goes on."""

    type: Literal["driver"] = "driver"
    driver: Driver


class ClockCommand(Message):
    """Change the viewer's clock. Not for a live race, where only `live` (to the newest known) and `pause` work.

    `step` goes one lap on, or back with `lap` one less; `seek` goes to the begin of lap `lap`, or to `time_s`; `speed` sets the speed.
    """

    type: Literal["clock"] = "clock"
    command: Literal["play", "pause", "step", "back", "seek", "speed", "live"]
    lap: Annotated[int, Field(ge=1, le=200)] | None = None
    time_s: Annotated[float, Field(ge=0.0, le=100_000.0)] | None = None
    speed: Annotated[float, Field(ge=SLOWEST, le=FASTEST)] | None = None


class SetDelay(Message):
    """Set the broadcast delay: the server holds back everything by so much."""

    type: Literal["delay"] = "delay"
    delay_s: Annotated[float, Field(ge=0.0, le=MOST_DELAY_S)]


class AskCall(Message):
    """Ask for the call of an earlier lap, or of this one, again: answered with a call message."""

    type: Literal["ask call"] = "ask call"
    lap: Annotated[int, Field(ge=1, le=200)]


class Explain(Message):
    """Ask why: an explanation of the call of a lap up to the present one.

    Attributes:
        request: number of the viewer's choice, which the answer repeats.
        target: of a counterfactual, the other call; None for the next best.
    """

    type: Literal["explain"] = "explain"
    request: Request
    method: Method
    lap: Annotated[int, Field(ge=1, le=200)]
    target: Call | None = None


FromViewer = Annotated[
    WatchSimulated | WatchRecorded | ChooseDriver | ClockCommand | SetDelay | AskCall | Explain, Field(discriminator="type")
]
from_viewer: TypeAdapter[FromViewer] = TypeAdapter(FromViewer)
"""Reads any message of a viewer."""
