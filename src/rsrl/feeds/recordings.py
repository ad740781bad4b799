"""Any recording as canonical events, told by what is in it: live timing in its forms, a game's packets, a session of OpenF1."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event

__all__ = ["recording_events"]

OPENF1: Final = "openf1:"


def recording_events(source: str, anomalies: Anomalies, season: int = 0) -> Iterable[Event]:
    """The events of a recording.

    Args:
        source: path of a file or folder, `-` for standard input, or `openf1:` with a session's key.
        anomalies: what could not be read is counted there.
        season: where live timing does not say; 0 for unknown.

    Raises:
        RsrlError: it cannot be read, or is no recording; with live timing and games, as late as the first event is asked for.
    """
    if source.startswith(OPENF1):
        from rsrl.feeds.openf1 import openf1_events

        key = source.removeprefix(OPENF1)
        if not re.fullmatch(r"\d{1,9}", key, re.ASCII):
            raise RsrlError(f"{source}: is no session of OpenF1; write its key, such as {OPENF1}7953")
        return openf1_events(int(key), anomalies=anomalies)
    path = Path(source)
    if _is_game(path):
        from rsrl.feeds.games import game_events

        return game_events(path, anomalies)
    from rsrl.feeds.live_timing import live_timing_events

    return live_timing_events(path, anomalies, season=season)


def _is_game(path: Path) -> bool:
    """Whether a file begins as a recording of a game does. A pipe is left alone: what is read of it is gone."""
    from rsrl.feeds.games.recording import MAGIC

    if not path.is_file():
        return False
    try:
        with path.open("rb") as stream:
            return stream.read(len(MAGIC)) == MAGIC
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
