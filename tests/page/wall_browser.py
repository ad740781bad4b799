"""A real browser at a real pit wall: the command `rsrl wall`, a line to it that can be cut, and pages that note what went wrong in them."""

import os
import re
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import Final

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

CHROMIUM: Final = "/usr/bin/chromium"
WAIT_MS: Final = 240_000
"""What does not come in so long does not come: compiling may be under way."""

RACE: Final = "race=bahrain-2023&seed=0"


@contextmanager
def wall() -> Iterator[int]:
    """`rsrl wall` on a free port; gives the port."""
    command = [sys.executable, "-m", "rsrl", "wall", "--no-browser", "--port", "0"]
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment) as process:
        assert process.stdout is not None
        said = ""
        for line in process.stdout:
            said += line
            if found := re.search(r"http://[^:/]+:(\d+)/", line):
                break
        else:
            raise AssertionError(f"rsrl wall ended: {said}")
        reader = threading.Thread(target=process.stdout.read)  # so that the server never waits for room in the pipe
        reader.start()
        try:
            yield int(found[1])
        finally:
            process.terminate()
            reader.join()


@contextmanager
def browser() -> Iterator[Browser]:
    """Debian's Chromium; the test is skipped where it is absent."""
    if not shutil.which(CHROMIUM):
        pytest.skip(f"no browser: {CHROMIUM} is absent")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        try:
            yield chromium
        finally:
            chromium.close()


class Line:
    """A line to a server that can be cut and mended; `port` is its near end."""

    def __init__(self, server_port: int) -> None:
        self._far = ("127.0.0.1", server_port)
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        self._open: list[socket.socket] = []
        self._whole = True
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """End all connections, and take no others."""
        self._whole = False
        for one in self._open:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        self._open.clear()

    def mend(self) -> None:
        """Take connections again."""
        self._whole = True

    def close(self) -> None:
        """End for good."""
        self.cut()
        self._listening.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listening.accept()
                if not self._whole:
                    near.close()
                    continue
                far = socket.create_connection(self._far)
                self._open += [near, far]
                for source, sink in ((near, far), (far, near)):
                    threading.Thread(target=_pass_on, args=(source, sink), daemon=True).start()


def _pass_on(source: socket.socket, sink: socket.socket) -> None:
    with suppress(OSError), closing(sink):
        while data := source.recv(65536):
            sink.sendall(data)


class Watched:
    """A page and what went wrong in it: errors on the console, requests to anywhere but `port`."""

    def __init__(self, page: Page, port: int) -> None:
        self.page, self.base = page, f"http://127.0.0.1:{port}/"
        self.wrong: list[str] = []
        page.set_default_timeout(WAIT_MS)
        page.on("console", lambda said: self.wrong.append(said.text) if said.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: self.wrong.append(str(error)))
        page.on("request", self._requested)

    def _requested(self, request: object) -> None:
        url = str(getattr(request, "url", ""))
        if not url.startswith((self.base, "blob:")):
            self.wrong.append(f"asks {url}")

    def open(self, link: str) -> Page:
        """Go to a link; the page once it shows the race and its call."""
        self.page.goto(self.base + link)
        self.page.wait_for_selector("section.call .large:not(:has-text('Waiting'))")
        return self.page
