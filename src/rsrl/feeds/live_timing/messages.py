"""One line of a recording as messages: the four forms in which the live feed is recorded.

| form | a line |
| --- | --- |
| archive, a file `<Topic>.jsonStream` for each topic | `00:43:09.173{"Lines":{...}}` |
| SignalR as FastF1 records it | `['TimingData', {'Lines': {...}}, '2025-11-08T14:37:19.463Z']`; the snapshot `['Topic', '<json>', '']` |
| undercut-f1, `live.jsonl` beside `subscribe.json` | `{"Type":"TimingData","Json":{...},"DateTime":"2025-..."}` |
| RSRL's own, by `rsrl record f1` | `{"topic":"TimingData","data":{...},"utc":"2025-..."}`; `{"snapshot":{"Topic":{...}},"utc":"..."}` |

Each line says by itself which form it has, so lines need no other sign of where they are from.
"""

import ast
import warnings
from datetime import datetime, timezone
from typing import Any, Final, NamedTuple

import msgspec

__all__ = ["TOPICS", "Message", "own_line", "parse_line", "snapshot_messages"]

TOPICS: Final = (
    "SessionInfo", "SessionStatus", "LapCount", "DriverList", "TrackStatus", "SessionData", "TimingAppData", "TimingData",
    "TimingDataF1", "RaceControlMessages", "WeatherData", "Heartbeat",
)  # fmt: skip
"""Topics that are read, in the order in which a snapshot is best read; all of them are open without a login."""

_SAME: Final = {"TimingDataF1": "TimingData"}
_READ: Final = frozenset(TOPICS)
_WANTED: Final = {topic.encode() for topic in TOPICS}
_BOM: Final = b"\xef\xbb\xbf"
MOST_HOURS: Final = 99

_decode: Final = msgspec.json.Decoder().decode


class Message(NamedTuple):
    """What a topic says at a moment.

    Attributes:
        payload: the change of the topic's state; all of it where `snapshot`.
        stamp_s: seconds of the session in an archive, seconds since 1970 (UTC) elsewhere; None where the line has no time.
        snapshot: the state of the topic when the feed was joined.
    """

    topic: str
    payload: dict[str, Any]
    stamp_s: float | None
    snapshot: bool = False


def parse_line(line: bytes, topic: str | None = None) -> list[Message]:
    """The messages of a line, none for one of a topic that is not read.

    Args:
        line: without its line end; a byte order mark may stand before it.
        topic: of the file, for lines of an archive.

    Raises:
        ValueError: the line has none of the forms.
    """
    text = line.removeprefix(_BOM).strip()
    first = text[:1]
    if first == b"[":
        return _signalr(text)
    if first == b"{":
        return _keyed(text)
    if first.isdigit() and topic is not None:
        return _archived(text, topic)
    raise ValueError("no form of live timing")


def snapshot_messages(topics: object, stamp_s: float | None) -> list[Message]:
    """The messages of an opening snapshot, topic to state, in the order of `TOPICS`. Raises ValueError where it is no such mapping."""
    if not isinstance(topics, dict):
        raise ValueError("a snapshot maps topics to their state")
    known = (topic for topic in TOPICS if isinstance(topics.get(topic), dict))
    return [Message(_SAME.get(topic, topic), topics[topic], stamp_s, snapshot=True) for topic in known]


def own_line(topic: str, data: object, utc: str) -> bytes:
    """A line of RSRL's own form, with its line end."""
    return msgspec.json.encode({"topic": topic, "data": data, "utc": utc}) + b"\n"


def _archived(text: bytes, topic: str) -> list[Message]:
    """`HH:MM:SS.mmm{json}`."""
    if text[2:3] != b":" or text[5:6] != b":" or text[8:9] != b".":
        raise ValueError("no time at the start of the line")
    hours, minutes, seconds = int(text[:2]), int(text[3:5]), float(text[6:12])
    if hours > MOST_HOURS or minutes > 59 or not 0 <= seconds < 60:
        raise ValueError("no time of day")
    return _message(topic, json_value(text[12:]), 3600.0 * hours + 60.0 * minutes + seconds)


def _signalr(text: bytes) -> list[Message]:
    """`['Topic', {delta}, 'utc']`, or `['Topic', '<json>', '']` for a topic's snapshot."""
    quote = text[1:2]
    if text[2 : text.find(quote, 2)] not in _WANTED:
        if quote not in (b"'", b'"') or text[-1:] != b"]":
            raise ValueError("no topic")
        return []
    topic, payload, utc = python_value(text)
    if isinstance(payload, str):
        return _message(topic, json_value(payload.encode()), _utc_s(utc), snapshot=True)
    return _message(topic, payload, _utc_s(utc))


def _keyed(text: bytes) -> list[Message]:
    """A line of undercut-f1 or of RSRL's own."""
    whole = json_value(text)
    if "snapshot" in whole:
        return snapshot_messages(whole["snapshot"], _utc_s(whole.get("utc")))
    if "topic" in whole:
        return _message(whole["topic"], whole.get("data"), _utc_s(whole.get("utc")))
    if "Type" in whole:
        return _message(whole["Type"], whole.get("Json"), _utc_s(whole.get("DateTime")))
    raise ValueError("no topic")


def _message(topic: object, payload: object, stamp_s: float | None, snapshot: bool = False) -> list[Message]:
    if not isinstance(topic, str):
        raise ValueError("no topic")
    if topic not in _READ:
        return []
    if not isinstance(payload, dict):
        raise ValueError("no payload")
    return [Message(_SAME.get(topic, topic), payload, stamp_s, snapshot)]


def json_value(text: bytes) -> Any:
    """The value of a JSON text. Raises ValueError for anything else, however deeply nested."""
    try:
        return _decode(text)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise ValueError(str(error)) from None


def python_value(text: bytes) -> Any:
    """The value of a Python literal, never evaluated. Raises ValueError for anything else.

    A line without double quotes and backslashes is JSON but for its quotes and three words, and JSON is read some ten times as fast; the
    words are taken for words only between a key and what follows a value, where no text can stand.
    """
    if b'"' not in text and b"\\" not in text and b"': ':" not in text:
        changed = text.replace(b"'", b'"')
        for ours, theirs in _WORDS:
            if ours in changed:
                changed = changed.replace(ours + b",", theirs + b",").replace(ours + b"}", theirs + b"}")
        try:
            return _decode(changed)
        except (msgspec.MsgspecError, RecursionError):
            pass  # such as a list of truths, or no literal at all: the slow way tells
    elif text[1:2] == b'"':
        return json_value(text)
    try:
        with warnings.catch_warnings(action="ignore", category=SyntaxWarning):  # of what is no literal anyway
            value = ast.literal_eval(text.decode())
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
        raise ValueError(str(error)) from None
    if not _is_json(value):
        raise ValueError("a literal that no feed has")
    return value


def _is_json(value: object) -> bool:
    """Whether a value is one that JSON has: no sets and tuples, text alone for keys, and no half characters in it."""
    if isinstance(value, str):
        return value.isascii() or not any("\ud800" <= letter <= "\udfff" for letter in value)
    if isinstance(value, dict):
        return all(isinstance(key, str) and _is_json(key) and _is_json(inner) for key, inner in value.items())
    if isinstance(value, list):
        return all(map(_is_json, value))
    return value is None or isinstance(value, int | float)


_WORDS: Final = ((b'": True', b'": true'), (b'": False', b'": false'), (b'": None', b'": null'))


def _utc_s(utc: object) -> float | None:
    """Seconds since 1970 of an ISO time; None for none. Raises ValueError for what is no time."""
    if utc is None or utc == "":
        return None
    if not isinstance(utc, str):
        raise ValueError("a time is text")
    moment = datetime.fromisoformat(utc)
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=timezone.utc)  # noqa: UP017  # one spelling for 3.11 and later
    return moment.timestamp()
