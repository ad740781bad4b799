"""A server of the live feed for tests: it speaks the protocol byte by byte, with no library of the client's."""

import asyncio
import base64
import contextlib
import hashlib
import json
from collections.abc import AsyncIterator, Sequence
from typing import Any

GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # of RFC 6455
COOKIE, TOKEN = "AWSALBCORS=abc123", "token/1+2"
END = b"\x1e"

Step = dict[str, Any] | str
"""A message to send, or "drop" (end the connection without a word), "close" (say so first), "hang" (say nothing more), "garbage"."""


def feed(topic: str, payload: Any, utc: str = "2025-11-09T17:00:05.1Z") -> Step:
    return {"type": 1, "target": "feed", "arguments": [topic, payload, utc]}


class SignalrServer:
    """Serves one script a connection; the last one again for any further.

    Attributes:
        scripts: for each connection its opening snapshot and what follows.
        negotiated: requests before the WebSocket, as method and path.
        headers: of each WebSocket.
        subscribed: topics asked for on each connection.
        refusals: answers 503 to so many negotiations first.
    """

    def __init__(self, scripts: Sequence[tuple[dict[str, Any], Sequence[Step]]], refusals: int = 0) -> None:
        self.scripts, self.refusals = list(scripts), refusals
        self.negotiated: list[tuple[str, str]] = []
        self.headers: list[dict[str, str]] = []
        self.subscribed: list[list[str]] = []

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[str]:
        """Its address while it runs."""
        server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        async with server:
            yield f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/signalrcore"

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError):
            while True:
                head = (await reader.readuntil(b"\r\n\r\n")).decode()
                request, *lines = head.split("\r\n")
                method, path, _ = request.split(" ")
                headers = {name.lower(): value for name, _, value in (line.partition(": ") for line in lines)}
                if "upgrade" in headers:
                    await self._web_socket(headers, path, reader, writer)
                    break
                await reader.readexactly(int(headers.get("content-length", 0)))
                self.negotiated.append((method, path))
                writer.write(self._negotiation(method))
                await writer.drain()
        writer.close()

    def _negotiation(self, method: str) -> bytes:
        if self.refusals and method == "POST":
            self.refusals -= 1
            return b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\n\r\n"
        body = b"" if method == "OPTIONS" else json.dumps({"connectionToken": TOKEN, "availableTransports": []}).encode()
        return f"HTTP/1.1 200 OK\r\nSet-Cookie: {COOKIE}; Path=/\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body

    async def _web_socket(self, headers: dict[str, str], path: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.headers.append(headers | {"path": path})
        accept = base64.b64encode(hashlib.sha1((headers["sec-websocket-key"] + GUID).encode()).digest()).decode()
        upgrade = f"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
        writer.write(upgrade.encode())
        assert await self._read(reader) == b'{"protocol":"json","version":1}' + END
        writer.write(_frame(b"{}" + END))
        subscription = json.loads((await self._read(reader)).rstrip(END))
        assert (subscription["type"], subscription["target"]) == (1, "Subscribe")
        (topics,) = subscription["arguments"]
        self.subscribed.append(topics)
        snapshot, steps = self.scripts.pop(0) if len(self.scripts) > 1 else self.scripts[0]
        completion = {"type": 3, "invocationId": subscription["invocationId"], "result": snapshot}
        writer.write(_frame(json.dumps(completion).encode() + END + b'{"type":6}' + END))  # two messages in one frame
        for step in steps:
            if step == "drop":
                return
            if step == "hang":
                await reader.read()
            elif step == "close":
                writer.write(_frame(b'{"type":7}' + END))
            elif step == "garbage":
                writer.write(_frame(b"<html>" + END))
            else:
                writer.write(_frame(json.dumps(step).encode() + END))
            await writer.drain()

    async def _read(self, reader: asyncio.StreamReader) -> bytes:
        """The payload of a client's text frame, which is masked."""
        first, length = await reader.readexactly(2)
        assert first == 0x81
        assert length & 0x80
        size = length & 0x7F
        if size == 126:
            size = int.from_bytes(await reader.readexactly(2), "big")
        mask = await reader.readexactly(4)
        return bytes(byte ^ mask[i % 4] for i, byte in enumerate(await reader.readexactly(size)))


def _frame(payload: bytes) -> bytes:
    """A server's text frame."""
    size = len(payload)
    head = bytes([0x81, size]) if size < 126 else bytes([0x81, 126]) + size.to_bytes(2, "big")
    return head + payload
