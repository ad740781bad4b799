"""OpenF1's history over REST, fetched once: what is past does not change, so it is kept for good."""

import email.utils
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

import httpx
import msgspec

from rsrl.cache_folder import cache_folder
from rsrl.errors import RsrlError

__all__ = ["BASE_URL", "FIRST_SEASON", "OpenF1", "Row", "parse_rows"]

BASE_URL: Final = "https://api.openf1.org/v1"
FIRST_SEASON: Final = 2023

TRIES: Final = 6
FIRST_WAIT_S: Final = 1.0
LONGEST_WAIT_S: Final = 120.0
TIMEOUT_S: Final = 60.0
TRY_AGAIN: Final = (429, 500, 502, 503, 504)

CLOSED: Final = "OpenF1: a Formula One session is on, and until it is over even history needs a paid account; try again later"

SETTLED_AFTER: Final = timedelta(hours=6)
"""After the end of a session; until then its rows may still grow, and are fetched anew."""

Row = dict[str, Any]


class OpenF1:
    """A client of the history, without an account.

    While any session is on, anonymous access is refused even for history.

    Args:
        url: the address, without a slash at its end.
        folder: where rows are kept; None for `openf1` in the cache folder.
        wait: sleeps so many seconds; tests give one that does not.
    """

    def __init__(self, url: str = BASE_URL, folder: Path | None = None, wait: Callable[[float], None] = time.sleep) -> None:
        self.url, self._wait = url, wait
        cache = cache_folder()
        self.folder = folder or (cache / "openf1" if cache else None)

    def session(self, key: int) -> Row:
        """The row of a session. Raises RsrlError where there is none, or it cannot be had."""
        rows = self._kept(f"session-{key}", lambda: self._fetch("sessions", {"session_key": key}), _is_settled)
        if not rows:
            raise RsrlError(f"OpenF1 has no session {key}; its history begins with {FIRST_SEASON}")
        return rows[0]

    def race_key(self, season: int, grand_prix: str, same: Callable[[str, str], bool], name: str = "Race") -> int:
        """Key of the race of a Grand Prix.

        Args:
            same: whether a meeting's name means the Grand Prix.
            name: of the session: Race or Sprint.

        Raises:
            RsrlError: there is none, or it cannot be had.
        """
        if season < FIRST_SEASON:
            raise RsrlError(f"OpenF1 has no {season}; its history begins with {FIRST_SEASON}")
        meetings = self._fetch("meetings", {"year": season})
        keys = [row.get("meeting_key") for row in meetings if same(str(row.get("meeting_name")), grand_prix)]
        sessions = self._fetch("sessions", {"meeting_key": keys[-1], "session_name": name}) if keys else []
        if not sessions or not isinstance(sessions[0].get("session_key"), int):
            raise RsrlError(f"OpenF1 has no {name.lower()} of {grand_prix} {season}")
        key: int = sessions[0]["session_key"]
        return key

    def rows(self, endpoint: str, session: Row) -> list[Row]:
        """All rows of an endpoint for a session, none where it has none. Raises RsrlError where they cannot be had."""
        key = session["session_key"]
        return self._kept(f"{key}-{endpoint}", lambda: self._fetch(endpoint, {"session_key": key}), lambda _: _is_settled([session]))

    def _kept(self, name: str, fetch: Callable[[], list[Row]], is_settled: Callable[[list[Row]], bool]) -> list[Row]:
        path = self.folder / f"{name}.json" if self.folder else None
        if path and path.is_file():
            try:
                return parse_rows(path.read_bytes())
            except ValueError:  # cut short by a crash, say: fetched again
                path.unlink()
        rows = fetch()
        if path and is_settled(rows):
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_suffix(".part")
            partial.write_bytes(msgspec.json.encode(rows))
            partial.replace(path)
        return rows

    def _fetch(self, endpoint: str, query: dict[str, Any]) -> list[Row]:
        why = ""
        for attempt in range(TRIES):
            try:
                answer = httpx.get(f"{self.url}/{endpoint}", params=query, timeout=TIMEOUT_S)
            except httpx.HTTPError as error:
                why = " ".join(str(error).split()) or type(error).__name__
                self._wait(min(FIRST_WAIT_S * 2**attempt, LONGEST_WAIT_S))
                continue
            if answer.status_code == 401:
                raise RsrlError(CLOSED)
            if answer.status_code == 404:  # how it says that a query finds nothing
                return []
            if answer.status_code not in TRY_AGAIN:
                return self._answered(answer, endpoint)
            why = f"it answers {answer.status_code}"
            self._wait(_asked_wait_s(answer) or min(FIRST_WAIT_S * 2**attempt, LONGEST_WAIT_S))
        raise RsrlError(f"OpenF1 cannot be reached after {TRIES} tries: {why}; what was fetched is kept, so try again later")

    def _answered(self, answer: httpx.Response, endpoint: str) -> list[Row]:
        try:
            answer.raise_for_status()
            return parse_rows(answer.content)
        except (httpx.HTTPError, ValueError) as error:
            raise RsrlError(f"OpenF1: {endpoint} is not answered as expected ({' '.join(str(error).split())})") from None


def parse_rows(content: bytes) -> list[Row]:
    """Rows of a JSON text. Raises ValueError where it is no list of objects."""
    try:
        return msgspec.json.decode(content, type=list[Row])
    except msgspec.MsgspecError as error:
        raise ValueError(str(error)) from None


def _is_settled(rows: list[Row]) -> bool:
    """Whether a session has been over for long enough."""
    try:
        ended = datetime.fromisoformat(rows[0]["date_end"])
    except (IndexError, KeyError, TypeError, ValueError):
        return False
    ended = ended if ended.tzinfo else ended.replace(tzinfo=UTC)
    return datetime.now(UTC) - ended > SETTLED_AFTER


def _asked_wait_s(answer: httpx.Response) -> float | None:
    """Seconds that the server asks to wait, given as such or as a date; None where it does not, never more than `LONGEST_WAIT_S`."""
    asked = answer.headers.get("Retry-After", "")
    if asked.isdecimal():
        return min(float(asked), LONGEST_WAIT_S)
    try:
        moment = email.utils.parsedate_to_datetime(asked)
    except (TypeError, ValueError):
        return None
    return min(max((moment - datetime.now(UTC)).total_seconds(), 0.0), LONGEST_WAIT_S)
