"""A real server on a free port, and viewers of it."""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final

import uvicorn
from websockets import Origin
from websockets.sync.client import ClientConnection, connect

from rsrl.wall import Settings
from rsrl.wall.messages import from_server
from rsrl.wall.server import bind, config

WAIT_S: Final = 60.0
"""A message that does not come in so long does not come: compiling may be under way."""

Message = dict[str, Any]


@contextmanager
def running(settings: Settings) -> Iterator[int]:
    """A server of these settings; gives its port."""
    listening = bind(settings.host, 0)
    port = int(listening.getsockname()[1])
    server = uvicorn.Server(config(replace(settings, port=port)))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    try:
        yield port
    finally:
        server.should_exit = True
        thread.join(30)
        listening.close()
        assert not thread.is_alive(), "the server does not end"


class Page:
    """A viewer in a test: says and hears messages, and checks each one that it hears."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.welcome = self.hear("welcome")

    def say(self, **message: object) -> None:
        self.socket.send(json.dumps({"version": 1, **message}))

    def next(self) -> Message:
        text = self.socket.recv(WAIT_S)
        from_server.validate_json(text)
        message: Message = json.loads(text)
        return message

    def hear(self, kind: str, that: Callable[[Message], bool] = lambda message: True) -> Message:
        until = time.monotonic() + WAIT_S
        while time.monotonic() < until:
            message = self.next()
            if message["type"] == kind and that(message):
                return message
        raise AssertionError(f"no such {kind} in {WAIT_S:.0f} s")


@contextmanager
def connected(
    port: int, sock: socket.socket | None = None, max_queue: int = 16, cookie: str = "", path: str = "/ws"
) -> Iterator[ClientConnection]:
    """A connection as a page of the server makes it."""
    base = f"127.0.0.1:{port}"
    headers = {"Cookie": cookie} if cookie else None
    with connect(
        f"ws://{base}{path}",
        sock=sock,
        origin=Origin(f"http://{base}"),
        compression=None,
        max_size=None,
        max_queue=max_queue,
        additional_headers=headers,
        proxy=None,
        close_timeout=1,  # a viewer that reads nothing does not hear the answer to its good-bye
    ) as connection:
        yield connection
