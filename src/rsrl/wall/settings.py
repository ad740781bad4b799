"""What the server is started with, and its bounds."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from rsrl.wall.catalogue import LiveSource

MESSAGE_BYTES: Final = 4096
"""Of a message from a viewer; the largest that a page sends is below 300."""

MOST_VIEWERS: Final = 64
MOST_SESSIONS: Final = 6
"""Sessions with nobody watching make room for new ones."""

LEAST_TOKEN: Final = 16
DEFAULT_PORT: Final = 8044
DEFAULT_SPEED: Final = 10.0


class View(NamedTuple):
    """What a viewer looks at, as the log keeps it and a restart goes on with it.

    Attributes:
        source: "simulated", or the name of a recording or live source in the welcome's list.
        driver: of a simulated race, whose car the policy drives; else, whose car is looked at.
        car: looked at, where it is another one.
        time_s: race time that is shown.
        lap: to begin at, instead of `time_s`.
    """

    source: str
    race: str
    driver: str | None
    seed: int = 0
    time_s: float = 0.0
    speed: float = DEFAULT_SPEED
    playing: bool = True
    delay_s: float = 0.0
    lap: int | None = None
    car: str | None = None


@dataclass(frozen=True)
class Settings:
    """Of one server.

    Attributes:
        model: the policy.
        laps: folder whose lap files can be replayed; None for none.
        host, port: where it listens; 0 for any port that is free.
        token: what a viewer must know; None where only this machine can reach the server.
        first: what a viewer sees at first; None to let it choose.
        log: the session log; None to keep none.
        live: sources that the server was started with.
        assets: folder of the built page.
    """

    model: str = "all"
    laps: Path | None = None
    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
    token: str | None = None
    first: View | None = None
    log: Path | None = None
    live: tuple["LiveSource", ...] = ()
    assets: Path = field(default_factory=lambda: Path(__file__).parent / "assets")
    viewers: int = MOST_VIEWERS
    sessions: int = MOST_SESSIONS
