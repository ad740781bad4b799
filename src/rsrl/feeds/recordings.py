"""Any source of a race as canonical events, told by what is in it: lap files, live timing, games, OpenF1, logs of RSRL's own."""

import gzip
import re
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Literal, NamedTuple

from rsrl.errors import RsrlError
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.event_log import LOG_KEY
from rsrl.feeds.events import Event

__all__ = ["STALE_AFTER_S", "Source", "open_source", "recording_events", "source_kind"]

OPENF1: Final = "openf1:"

STALE_AFTER_S: Final = 8.0
"""A feed of cars that has told of none of them for so long is stale. In three recorded races cars are told of every 5.5 s at least while
they race, but for one hole of 28 s."""

LAP_FILES: Final = (".csv", ".csv.gz", ".parquet")
_ARCHIVED: Final = re.compile(rb"\d\d:\d\d:\d\d\.\d{3}[\[{]")
_SNIFFED: Final = 1 << 12

Kind = Literal["lap file", "live timing", "game", "OpenF1", "log"]


class Source(NamedTuple):
    """A source that is read.

    Attributes:
        events: canonical events as they became known.
        stale_after_s: what a silence of the cars may last; None where the source tells of laps alone.
    """

    kind: Kind
    events: Iterable[Event]
    stale_after_s: float | None


def open_source(source: str, anomalies: Anomalies, race: str | None = None, season: int = 0) -> Source:
    """A source by its name; lap files too.

    Args:
        source: path of a file or folder, `-` for standard input, or `openf1:` with a session's key.
        anomalies: what could not be read is counted there.
        race: which one of a lap file with several.
        season: where live timing does not say; 0 for unknown.

    Raises:
        RsrlError: it cannot be read, or is no source; with live timing and games, as late as the first event is asked for.
    """
    kind = source_kind(source)
    if kind == "lap file":
        from rsrl.feeds.lap_files import lap_events, read_lap_file

        return Source(kind, lap_events(read_lap_file(Path(source), race)[1]), None)
    return Source(kind, recording_events(source, anomalies, season), STALE_AFTER_S)


def recording_events(source: str, anomalies: Anomalies, season: int = 0) -> Iterable[Event]:
    """The events of a recording: of any source of `open_source` but a lap file, which `rsrl.feeds.lap_files` reads. Raises as it does."""
    kind, path = source_kind(source), Path(source)
    if kind == "OpenF1":
        from rsrl.feeds.openf1 import openf1_events, openf1_folder_events

        if not source.startswith(OPENF1):
            return openf1_folder_events(path, anomalies)
        key = source.removeprefix(OPENF1)
        if not re.fullmatch(r"\d{1,9}", key, re.ASCII):
            raise RsrlError(f"{source}: is no session of OpenF1; write its key, such as {OPENF1}7953")
        return openf1_events(int(key), anomalies=anomalies)
    if kind == "game":
        from rsrl.feeds.games import game_events

        return game_events(path, anomalies)
    if kind == "log":
        from rsrl.feeds.event_log import log_events

        return log_events(path, anomalies)
    from rsrl.feeds.live_timing import live_timing_events

    return live_timing_events(path, anomalies, season=season)


def source_kind(source: str) -> Kind:
    """What a source is, by its beginning; a table is a lap file by the end of its name. A pipe is live timing: what is read of it is gone.

    Raises RsrlError where a file cannot be read.
    """
    if source.startswith(OPENF1):
        return "OpenF1"
    path = Path(source)
    if path.is_dir():
        from rsrl.feeds.openf1 import is_openf1_folder

        return "OpenF1" if is_openf1_folder(path) else "live timing"
    return _kind_of_file(path) if path.is_file() else "lap file" if source.endswith(LAP_FILES) else "live timing"


def _kind_of_file(path: Path) -> Kind:
    from rsrl.feeds.games.recording import MAGIC

    begin = _beginning(path)
    if begin.startswith(MAGIC):
        return "game"
    text = begin.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text.startswith(f'{{"{LOG_KEY}"'.encode()):
        return "log"
    if text[:1] in (b"[", b"{") or _ARCHIVED.match(text) or not path.name.endswith(LAP_FILES):
        return "live timing"
    return "lap file"


def _beginning(path: Path) -> bytes:
    """The first bytes of a file, unpacked."""
    try:
        with path.open("rb") as raw:
            if path.suffix != ".gz":
                return raw.read(_SNIFFED)
            with gzip.open(raw) as unpacked:
                return unpacked.read(_SNIFFED)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        return b""  # the readers say what is wrong
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror})") from None
