"""What the server says beside race, history and call: what there is to choose, the session, the clock, explanations, errors."""

from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from rsrl.wall.messages.base import Call, Driver, Marks, Message, Strict
from rsrl.wall.messages.call import CallMessage
from rsrl.wall.messages.snapshot import History, Race

SourceKind = Literal["simulated", "recorded", "live"]
Method = Literal["what-if", "attribution", "tree", "counterfactual", "summary", "training"]


class RaceChoice(Strict):
    """A race that can be simulated; `drivers` of those that have been read so far, else empty."""

    name: str
    event: str
    season: int
    laps: int
    wet: bool
    default_driver: Driver


class RecordingChoice(Strict):
    """A recorded race, by the name of its file in the folder given at the start and the name of the race in it; or a live source."""

    name: str
    race: str
    event: str
    season: int
    kind: Literal["recorded", "live"]


class Limits(Strict):
    """Bounds of the server: bytes of a message, viewers at a time, sessions at a time, delay in s, speeds of a clock."""

    message_bytes: int
    viewers: int
    sessions: int
    delay_s: float
    slowest: float
    fastest: float


class Welcome(Message):
    """First message to every viewer. `viewer` names it for the log. After a restart with --resume the last session follows at once."""

    type: Literal["welcome"] = "welcome"
    viewer: str
    rsrl: str
    model: str
    races: tuple[RaceChoice, ...]
    recordings: tuple[RecordingChoice, ...]
    limits: Limits


class SessionCar(Strict):
    """A car of the session: `number` as on the car where it is known, `colour` of its team, `dashed` for the second car of a team."""

    driver: Driver
    number: int | None
    team: str
    colour: str
    dashed: bool
    grid: int | None


class Session(Message):
    """The race that the viewer watches, and which car.

    Attributes:
        session: name of the session; two viewers of the same race and seed share one.
        kind: where the race is from. A viewer has its own clock unless the race is live.
        race, event, season, laps: of the race; total laps None where unknown.
        seed, race_number, driven: of a simulated race, whose car `driven` is driven by the policy's calls.
        note: why there are no calls, or what else is particular.
        methods: explanations that can be asked for.
        pit_losses_s: mean loss of a stop of `driver` under green, VSC and SC; None without a season file.
        cars: in grid order.
    """

    type: Literal["session"] = "session"
    session: str
    kind: SourceKind
    race: str
    event: str
    season: int
    laps: int | None
    seed: int | None
    race_number: int | None
    driven: Driver | None
    driver: Driver
    model: str
    note: str
    methods: tuple[Method, ...]
    pit_losses_s: tuple[float, float, float] | None
    cars: tuple[SessionCar, ...]


class Clock(Message):
    """The viewer's clock, sent whenever it changes and once a second while it runs.

    Attributes:
        time_s: session time that is shown, the delay taken off.
        lap: of the leader then.
        speed: seconds of the race a second.
        known_s, known_lap: how far the race is known to the server: all of it for a recorded one, up to now for a live one.
        lap_starts_s: session time at which the leader began each lap, from lap 1; a seek by lap goes there.
        delay_s: the broadcast delay. The server holds everything back by it, calls and messages too: one buffer for everything.
    """

    type: Literal["clock"] = "clock"
    session: str
    playing: bool
    time_s: float
    lap: int
    speed: float
    known_s: float
    known_lap: int
    lap_starts_s: tuple[float, ...]
    delay_s: float
    live: bool


class Progress(Message):
    """An explanation under way: `done` of `of` parts."""

    type: Literal["progress"] = "progress"
    request: int
    done: int
    of: int
    words: str


class ExplanationRow(Strict):
    """A row: an option, a player of an attribution, a condition of a path, a change, a lap. `columns` depend on the method."""

    label: str
    value: float | None
    low: float | None = None
    high: float | None = None
    columns: dict[str, Any]


class ExplanationMessage(Message):
    """An explanation that was asked for.

    Attributes:
        request: number that the viewer gave it.
        method, lap, driver: of what was asked.
        question, unit: what `value` of the rows answers, in which unit.
        baseline: of an attribution, the value that the rows add up from.
        exact: values are computed, not estimated from samples.
        sentences: in words.
        notes: what could not be given and why; rows are empty if nothing could.
        details: further results by method: the tree's nodes and path, counterfactuals, stops, ...
        took_ms: how long it took.
    """

    type: Literal["explanation"] = "explanation"
    session: str
    request: int
    method: Method
    lap: int
    driver: Driver
    call: Call | None
    question: str
    unit: str
    baseline: float | None
    exact: bool
    budget: int
    rows: tuple[ExplanationRow, ...]
    sentences: tuple[str, ...]
    notes: tuple[str, ...]
    details: dict[str, Any]
    marks: Marks
    took_ms: float


class ErrorMessage(Message):
    """A refusal, in one clear line. `request` is that of the message refused, where it had one; `fatal`: the connection ends."""

    type: Literal["error"] = "error"
    code: Literal["malformed", "too large", "not now", "unknown", "busy", "too many", "failed", "version"]
    text: str
    request: int | None = None
    fatal: bool = False


FromServer = Annotated[
    Welcome | Session | Clock | Race | History | CallMessage | Progress | ExplanationMessage | ErrorMessage, Field(discriminator="type")
]
from_server: TypeAdapter[FromServer] = TypeAdapter(FromServer)
"""Reads any message of the server."""
