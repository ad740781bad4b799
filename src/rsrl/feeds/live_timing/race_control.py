"""Messages of race control to events: what a strategist has to know is written in words."""

import re
from collections.abc import Iterator
from typing import Final, Literal

from rsrl.feeds.events import Event, OvertakeAid, RaceControl

__all__ = ["race_control_events"]

Topic = Literal["note", "safety car in", "vsc ending", "time penalty", "drive-through", "stop and go", "penalty served", "disqualified"]

AID: Final = re.compile(r"(?:DRS|OVERTAKE) (ENABLED|DISABLED)", re.ASCII)
"""The whole message: "DRS DISABLED IN ZONE 2" is of one zone."""

CAR: Final = re.compile(r"\bCAR (\d{1,2})\b", re.ASCII)
SECONDS: Final = re.compile(r"\b(\d{1,3}) SECOND\b", re.ASCII)

PHRASES: Final[tuple[tuple[str, Topic], ...]] = (
    ("SAFETY CAR IN THIS LAP", "safety car in"),
    ("VSC ENDING", "vsc ending"),
    ("VIRTUAL SAFETY CAR ENDING", "vsc ending"),
    ("PENALTY SERVED", "penalty served"),
    ("STOP/GO PENALTY", "stop and go"),
    ("STOP AND GO PENALTY", "stop and go"),
    ("DRIVE THROUGH PENALTY", "drive-through"),
    ("DRIVE-THROUGH PENALTY", "drive-through"),
    ("SECOND TIME PENALTY", "time penalty"),
    ("DISQUALIFIED", "disqualified"),
)
"""What a message is about by the first phrase that stands in it. Only a penalty for a car is one: an investigation names none."""

OF_A_CAR: Final = ("time penalty", "drive-through", "stop and go", "penalty served", "disqualified")


def race_control_events(text: str, time_s: float) -> Iterator[Event]:
    """The message itself and, where it enables or disables DRS or the overtake mode, that."""
    text = " ".join(text.upper().split())
    if aid := AID.fullmatch(text):
        yield OvertakeAid(time_s, aid[1] == "ENABLED")
    car = CAR.search(text)
    topic: Topic = next((topic for phrase, topic in PHRASES if phrase in text), "note")
    if topic in OF_A_CAR and car is None:
        topic = "note"
    seconds = SECONDS.search(text) if topic in ("time penalty", "penalty served", "stop and go") else None
    yield RaceControl(time_s, text, topic, int(car[1]) if car else None, float(seconds[1]) if seconds else None)
