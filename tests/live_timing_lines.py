"""Hand-made lines of live timing, and the events that come of them."""

import json
from pathlib import Path
from typing import Any, TypeVar

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event, FeedEvent, Heartbeat
from rsrl.feeds.live_timing import LiveTiming, live_timing_events
from rsrl.feeds.live_timing.messages import Message

T = TypeVar("T", bound=FeedEvent)

INFO = {"Key": 1, "Type": "Race", "Name": "Race", "StartDate": "2025-11-09T14:00:00", "Meeting": {"Name": "São Paulo Grand Prix"}}
DRIVERS = {"1": {"Tla": "VER", "TeamName": "Red Bull Racing"}, "4": {"Tla": "NOR", "TeamName": "McLaren"}}


def timing(**cars: dict[str, Any]) -> dict[str, Any]:
    """A payload of TimingData: `timing(c4={"Position": "1"})`."""
    return {"Lines": {name[1:]: line for name, line in cars.items()}}


def archived(time_s: float, payload: Any) -> str:
    hours, rest = divmod(time_s, 3600)
    return f"{int(hours):02}:{int(rest // 60):02}:{rest % 60:06.3f}{json.dumps(payload)}"


def write_archive(folder: Path, topics: dict[str, list[tuple[float, Any]]]) -> Path:
    """An archive folder, each file with a byte order mark and Windows line ends, as the real ones."""
    folder.mkdir(exist_ok=True)
    for topic, lines in topics.items():
        text = "".join(archived(time_s, payload) + "\r\n" for time_s, payload in lines)
        (folder / f"{topic}.jsonStream").write_bytes(b"\xef\xbb\xbf" + text.encode())
    return folder


def events_of(*said: tuple[str, Any, float] | tuple[str, Any, float, bool], anomalies: Anomalies | None = None) -> list[Event]:
    """The events of messages given as topic, payload, time and whether it is a snapshot; but that cars were told of is left out."""
    feed = LiveTiming(anomalies or Anomalies())
    return [event for one in said for event in feed.events(Message(*one)) if not (isinstance(event, Heartbeat) and event.on_track)]


def race_events(*said: tuple[str, Any, float] | tuple[str, Any, float, bool], anomalies: Anomalies | None = None) -> list[Event]:
    """As `events_of`, within a race that is on: SessionInfo, drivers, lines of both cars and the start come first and are left out."""
    opening: list[tuple[str, Any, float]] = [
        ("SessionInfo", INFO, 0.0),
        ("LapCount", {"CurrentLap": 1, "TotalLaps": 71}, 0.0),
        ("DriverList", DRIVERS, 0.0),
        ("TimingData", timing(c1={"InPit": False}, c4={"InPit": False}), 0.0),
        ("SessionStatus", {"Status": "Started"}, 1.0),
    ]
    return events_of(*opening, *said, anomalies=anomalies)[len(events_of(*opening)) :]


def only(kind: type[T], events: list[Event]) -> list[T]:
    return [event for event in events if isinstance(event, kind)]


def read(path: Path, anomalies: Anomalies | None = None, **options: Any) -> list[Event]:
    return list(live_timing_events(path, anomalies, **options))
