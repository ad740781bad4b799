"""A session of OpenF1 as files: the answers of its endpoints in a folder, as they were downloaded or as the client keeps them."""

from pathlib import Path
from typing import Final

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.openf1.client import Row, parse_rows
from rsrl.feeds.openf1.translate import ENDPOINTS, events_of_rows

__all__ = ["is_openf1_folder", "openf1_folder_events"]

SESSIONS: Final = "sessions.json"


def is_openf1_folder(path: Path) -> bool:
    """Whether a folder holds a session's row: `sessions.json`, or `session-<key>.json` as the client keeps it."""
    return (path / SESSIONS).is_file() or any(path.glob("session-*.json"))


def openf1_folder_events(path: Path, anomalies: Anomalies) -> list[Event]:
    """The events of the session of a folder; nothing is fetched.

    Args:
        path: holds `sessions.json` beside `laps.json`, `stints.json` and so on; or the client's `session-<key>.json` beside
            `<key>-laps.json`. Endpoints without file are taken to have no rows.

    Raises:
        RsrlError: a file is no answer of OpenF1, the folder holds several sessions, or no laps.
    """
    sessions = _rows(path / SESSIONS) if (path / SESSIONS).is_file() else [row for one in path.glob("session-*.json") for row in _rows(one)]
    if len(sessions) != 1:
        keys = ", ".join(sorted(str(row.get("session_key")) for row in sessions)[:5])
        raise RsrlError(f"{path}: holds {len(sessions)} sessions ({keys}); one was expected, so name one as openf1:KEY")
    key = sessions[0].get("session_key")
    files = {name: (path / f"{key}-{name}.json", path / f"{name}.json") for name in ENDPOINTS}
    tables = {name: _rows(next(one for one in both if one.is_file())) for name, both in files.items() if any(o.is_file() for o in both)}
    if not tables.get("laps"):
        raise RsrlError(f"{path}: holds no laps of session {key}; {key}-laps.json or laps.json was expected")
    return events_of_rows(sessions[0], tables, anomalies)


def _rows(path: Path) -> list[Row]:
    try:
        return parse_rows(path.read_bytes())
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise RsrlError(f"{path}: is no answer of OpenF1 ({error})") from None
