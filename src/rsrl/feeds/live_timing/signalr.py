"""The live feed itself: ASP.NET Core SignalR over a WebSocket, without a login.

A client negotiates (OPTIONS for the cookie that keeps it on one server, POST for a token), opens a WebSocket with the token, says which
protocol it speaks and subscribes to topics. The answer is the opening snapshot; updates and pings follow. Frames end with 0x1E.
"""

import asyncio
from collections.abc import AsyncGenerator, Sequence
from typing import Any, Final
from urllib.parse import quote

import httpx
import msgspec
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidHandshake, WebSocketException

from rsrl.feeds.live_timing.messages import json_value

__all__ = ["OPEN_TOPICS", "URL", "FeedLost", "Update", "updates"]

URL: Final = "https://livetiming.formula1.com/signalrcore"

OPEN_TOPICS: Final = (
    "TimingData", "TimingAppData", "TrackStatus", "RaceControlMessages", "LapCount", "WeatherData", "DriverList", "SessionInfo",
    "SessionData", "SessionStatus", "ExtrapolatedClock", "Heartbeat", "TopThree",
)  # fmt: skip
"""Topics that need no login; those of cars' telemetry and places on the track do, and no strategist misses them."""

SEPARATOR: Final = b"\x1e"
USER_AGENT: Final = "BestHTTP"
COOKIE: Final = "AWSALBCORS"
HANDSHAKE: Final = b'{"protocol":"json","version":1}' + SEPARATOR
CONNECT_S: Final = 20.0
SILENT_S: Final = 60.0
"""Pings come every fifteen seconds: after so long without anything the connection is dead."""

INVOCATION, COMPLETION, CLOSE = 1, 3, 7
LARGEST_MESSAGE: Final = 1 << 24

Update = tuple[str, dict[str, Any], str]
"""Topic, payload and UTC time of an update; the opening snapshot has the topic "" and maps topics to their state."""


class FeedLost(Exception):  # noqa: N818  # what happened, in words; the recorder connects again
    """The connection could not be made, or has ended."""


def frames(text: bytes) -> list[dict[str, Any]]:
    """The messages of a WebSocket message. Raises ValueError for what is none."""
    values = [json_value(frame) for frame in text.split(SEPARATOR) if frame]
    if not all(isinstance(value, dict) for value in values):
        raise ValueError("a frame is an object")
    return values


async def updates(url: str = URL, topics: Sequence[str] = OPEN_TOPICS, silent_s: float = SILENT_S) -> AsyncGenerator[Update, None]:
    """The opening snapshot and the updates of a connection, until it ends.

    Raises:
        FeedLost: it could not be made, or ended, or nothing came for `silent_s`.
    """
    try:
        token, cookie = await _negotiate(url)
        socket = f"ws{url.removeprefix('http')}?id={quote(token)}"
        headers = {"Cookie": cookie} if cookie else {}
        async with connect(
            socket, additional_headers=headers, user_agent_header=USER_AGENT, open_timeout=CONNECT_S, max_size=LARGEST_MESSAGE
        ) as connection:
            async for update in _subscribed(connection, topics, silent_s):
                yield update
    except TimeoutError:
        raise FeedLost(f"nothing came for {silent_s:.0f} s") from None
    except (OSError, httpx.HTTPError, WebSocketException, InvalidHandshake, ValueError) as error:
        raise FeedLost(" ".join(str(error).split()) or type(error).__name__) from None
    raise FeedLost("the server ended the connection")


async def _negotiate(url: str) -> tuple[str, str]:
    """Connection token and cookie."""
    async with httpx.AsyncClient(timeout=CONNECT_S, headers={"User-Agent": USER_AGENT}) as client:
        options = await client.options(f"{url}/negotiate")
        cookie = options.cookies.get(COOKIE)
        headers = {"Cookie": f"{COOKIE}={cookie}"} if cookie else {}
        client.cookies.clear()  # the header says it already
        answer = await client.post(f"{url}/negotiate?negotiateVersion=1", headers=headers)
        answer.raise_for_status()
    token = json_value(answer.content).get("connectionToken")
    if not isinstance(token, str):
        raise ValueError("the server gave no connection token")
    return token, headers.get("Cookie", "")


async def _subscribed(connection: ClientConnection, topics: Sequence[str], silent_s: float) -> AsyncGenerator[Update, None]:
    await connection.send(HANDSHAKE.decode())
    subscription = {"type": INVOCATION, "invocationId": "0", "target": "Subscribe", "arguments": [list(topics)]}
    await connection.send((msgspec.json.encode(subscription) + SEPARATOR).decode())
    while True:
        text = await asyncio.wait_for(connection.recv(), silent_s)
        for frame in frames(text.encode() if isinstance(text, str) else text):
            if frame.get("error"):
                raise ValueError(f"the server refuses: {frame['error']}")
            kind, arguments = frame.get("type"), frame.get("arguments")
            if kind == COMPLETION and isinstance(frame.get("result"), dict):
                yield "", frame["result"], ""
            elif kind == INVOCATION and frame.get("target") == "feed" and isinstance(arguments, list) and len(arguments) == 3:
                yield arguments[0], arguments[1], arguments[2]
            elif kind == CLOSE:
                return
