"""One connection: messages of the viewer read, checked and carried out; what is due sent. A viewer that is slow holds up itself alone."""

import asyncio
import logging
import time
from collections import deque
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any, Final, Literal

from pydantic import ValidationError
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from rsrl.errors import RsrlError
from rsrl.wall.catalogue import SIMULATED
from rsrl.wall.messages import (
    CALLS,
    AskCall,
    ChooseDriver,
    ClockCommand,
    ErrorMessage,
    Explain,
    FromViewer,
    Progress,
    SetDelay,
    Watch,
    WatchRecorded,
    WatchSimulated,
    from_viewer,
)
from rsrl.wall.sessions import Session
from rsrl.wall.settings import MESSAGE_BYTES, View
from rsrl.wall.show import FRAME_S, Show

if TYPE_CHECKING:
    from rsrl.wall.server import Wall

MOST_WAITING: Final = 64
"""Answers that wait for a viewer; one that lets more wait is cut off."""

MOST_A_SECOND: Final = 20.0
BURST: Final = 40.0
MOST_MALFORMED: Final = 20
LOG_S: Final = 5.0
LEAST_PROGRESS: Final = 0.1
"""Of an explanation, before it is told again."""

GONE: Final = (WebSocketDisconnect, ConnectionError)
"""A viewer that has gone is no fault."""

log = logging.getLogger("rsrl.wall")

Code = Literal["malformed", "too large", "not now", "unknown", "busy", "too many", "failed", "version"]


class Refused(Exception):  # noqa: N818  # a refusal is an answer, no error of the program
    """A message is refused in one line."""

    def __init__(self, code: Code, text: str, request: int | None = None, *, fatal: bool = False) -> None:
        super().__init__(text)
        self.message = ErrorMessage(code=code, text=text, request=request, fatal=fatal)


def _begin(message: Watch) -> dict[str, Any]:
    """Where a view begins."""
    named = message.model_dump(include={"lap", "time_s", "speed", "playing", "delay_s"})
    return {name: value for name, value in named.items() if value is not None}


class Viewer:
    """A viewer that is connected.

    Args:
        wall: the server's state.
        shows_first: the viewer sees at first what the server was started with; False for one that will say what it watches.
    """

    def __init__(self, name: str, socket: WebSocket, wall: "Wall", *, shows_first: bool = True) -> None:
        self._shows_first = shows_first
        self.name, self._socket, self._wall = name, socket, wall
        self._show: Show | None = None
        self._waiting: deque[str] = deque()
        self._news = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()
        self._going: asyncio.Task[None] | None = None
        self._allowance, self._heard_at = BURST, time.monotonic()
        self._malformed = 0
        self._logged_at = 0.0
        self._told_failed = False

    def wants(self, driver: str, look: int) -> bool:
        """As of `sessions.Watcher`."""
        return self._show is not None and self._show.wants(driver, look)

    def wake(self) -> None:
        """As of `sessions.Watcher`."""
        self._news.set()

    async def run(self) -> None:
        """Serve the viewer until it goes."""
        self.say(self._wall.welcome(self.name))
        if self._shows_first and self._wall.first is not None:
            self._go(self._wall.first)
        sender = asyncio.create_task(self._send())
        receiver = asyncio.create_task(self._receive())
        try:
            await asyncio.wait({sender, receiver}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            every = (sender, receiver, *self._tasks)
            for task in every:
                task.cancel()
            for ended in await asyncio.gather(*every, return_exceptions=True):
                if isinstance(ended, Exception) and not isinstance(ended, GONE):
                    log.error("viewer %s: %r", self.name, ended, exc_info=ended)
            self._leave()

    def say(self, text: str) -> None:
        """Let a message wait for the viewer."""
        self._waiting.append(text)
        self._news.set()

    async def _send(self) -> None:
        """Send what waits and what is due, until the viewer goes or lets too much wait."""
        while True:
            self._news.clear()
            if len(self._waiting) > MOST_WAITING:
                await self._socket.close(1013, "too slow")
                return
            while self._waiting:
                await self._socket.send_text(self._waiting.popleft())
            if self._show is not None:
                for text in self._show.due():
                    await self._socket.send_text(text)
                self._tell_failed(self._show)
                self._log(self._show)
            try:
                async with asyncio.timeout(FRAME_S):
                    await self._news.wait()
            except TimeoutError:
                continue

    def _tell_failed(self, show: Show) -> None:
        if show.session.log.failed and not self._told_failed:
            self._told_failed = True
            self.say(ErrorMessage(code="failed", text=show.session.log.failed).model_dump_json())

    def _log(self, show: Show, *, now: bool = False) -> None:
        if now or time.monotonic() - self._logged_at >= LOG_S:
            self._logged_at = time.monotonic()
            self._wall.log.note(show.view())

    async def _receive(self) -> None:
        """Read and carry out messages until the viewer goes or has sent too many that mean nothing."""
        while True:
            try:
                message = await self._socket.receive()
                if message["type"] == "websocket.disconnect":
                    return
                await self._carry_out(self._read(message.get("text")))
            except (WebSocketDisconnect, RuntimeError):
                return
            except Refused as refused:
                self._malformed += 1
                fatal = self._malformed > MOST_MALFORMED
                self.say(refused.message.model_copy(update={"fatal": fatal}).model_dump_json())
                if fatal:
                    await asyncio.sleep(FRAME_S)  # the answer goes first
                    await self._close(1008)
                    return

    async def _close(self, code: int) -> None:
        if self._socket.application_state is WebSocketState.CONNECTED:
            await self._socket.close(code)

    def _read(self, text: str | None) -> FromViewer:
        """A message checked. Raises Refused."""
        now = time.monotonic()
        self._allowance = min(self._allowance + (now - self._heard_at) * MOST_A_SECOND, BURST)
        self._heard_at = now
        if self._allowance < 1:
            raise Refused("too many", f"more than {MOST_A_SECOND:.0f} messages a second")
        self._allowance -= 1
        if text is None:
            raise Refused("malformed", "messages are JSON text")
        if len(text.encode("utf-8", "surrogatepass")) > MESSAGE_BYTES:
            raise Refused("too large", f"a message has at most {MESSAGE_BYTES} bytes")
        try:
            return from_viewer.validate_json(text)
        except ValidationError as error:
            first = error.errors(include_input=False, include_url=False, include_context=False)[0]
            where = ".".join(str(part) for part in first["loc"])[:100]
            code: Code = "version" if first["loc"][-1:] == ("version",) else "malformed"
            raise Refused(code, f"{where + ': ' if where else ''}{first['msg'][:200]}") from None
        except (ValueError, RecursionError):
            raise Refused("malformed", "the message is no JSON") from None

    async def _carry_out(self, message: FromViewer) -> None:
        if not isinstance(message, WatchSimulated | WatchRecorded) and self._going is not None:
            await asyncio.wait({self._going})  # what follows is meant for the race that is being opened
        match message:
            case WatchSimulated():
                self._go(View(SIMULATED, message.race, message.driver, message.seed, **_begin(message)))
            case WatchRecorded():
                self._go(View(message.name, message.race, message.driver, **_begin(message)))
            case ChooseDriver():
                self._choose(self._showing(), message.driver)
            case ClockCommand():
                why = self._showing().command(message)
                if why:
                    raise Refused("not now", why)
            case SetDelay():
                self._showing().set_delay(message.delay_s)
            case AskCall():
                show = self._showing()
                self._look(show, message.lap, None)
                self._spawn(self._answer_call(show, message.lap))
            case Explain():
                show = self._showing()
                self._look(show, message.lap, message.request)
                self._spawn(self._answer_explain(show, message))
        self._malformed = max(self._malformed - 1, 0)
        if self._show is not None and not isinstance(message, AskCall | Explain):
            self._log(self._show, now=True)
        self._news.set()

    def _showing(self) -> Show:
        if self._show is None:
            raise Refused("not now", "choose a race first")
        return self._show

    def _choose(self, show: Show, driver: str) -> None:
        known = self._wall.drivers(show.session)
        if known and driver not in known:
            raise Refused("unknown", f"unknown driver {driver!r}; in the race are {', '.join(known)}")
        show.choose(driver)
        self.say(self._wall.session_message(show.session, driver))

    def _look(self, show: Show, lap: int, request: int | None) -> None:
        """Refuse a lap of which nothing is known yet: what the clock and the delay hold back cannot be asked for either."""
        if show.session.log.look_for(show.driver, lap, show.shown_s()) is None:
            raise Refused("not now", f"nothing is known of lap {lap} of {show.driver} yet", request)

    def _spawn(self, work: Coroutine[None, None, None]) -> asyncio.Task[None]:
        if len(self._tasks) >= MOST_WAITING:
            work.close()
            raise Refused("busy", "too much is being waited for; ask again")
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def _go(self, view: View) -> None:
        """Begin to go to another session, instead of one that is still being opened."""
        if self._going is not None:
            self._going.cancel()
        self._going = self._spawn(self._watch(view))

    async def _watch(self, view: View) -> None:
        """Go to another session, or tell why not."""
        try:
            session = await self._wall.sessions.open(view)
            driver = self._wall.driver(session, view.car or view.driver)
        except RsrlError as error:
            self.say(ErrorMessage(code="unknown", text=str(error)).model_dump_json())
            return
        session.follow(driver)
        begin_s = await session.reached(driver, view.time_s, view.lap)
        self._leave()
        session.watchers.add(self)
        self.say(self._wall.session_message(session, driver))
        self._show = Show(session, driver, view._replace(time_s=begin_s))
        self._told_failed = False
        self._log(self._show, now=True)

    def _leave(self) -> None:
        if self._show is not None:
            self._show.session.watchers.discard(self)
            self._show = None

    async def _answer_call(self, show: Show, lap: int) -> None:
        until_s = show.shown_s()
        look = show.session.log.look_for(show.driver, lap, until_s)
        if look is not None:
            self.say(await show.session.asked_call(show.driver, look, until_s))

    async def _answer_explain(self, show: Show, message: Explain) -> None:
        from rsrl.wall.explanations import Asked

        until_s = show.shown_s()
        session: Session = show.session
        look = session.log.look_for(show.driver, message.lap, until_s)
        if look is None:
            return
        loop = asyncio.get_running_loop()
        told = -1.0

        def tell(done: int, of: int, words: str) -> None:
            nonlocal told
            if done < of and done / of < told + LEAST_PROGRESS:
                return
            told = done / of
            text = Progress(request=message.request, done=done, of=of, words=words).model_dump_json()
            loop.call_soon_threadsafe(self.say, text)

        target = None if message.target is None else CALLS.index(message.target)
        asked = Asked(session.name, message.request, message.method, show.driver, message.lap, target)
        answer = await session.explain(asked, look, tell, until_lap=self._until_lap(show, until_s))
        self.say(answer.model_dump_json())

    def _until_lap(self, show: Show, until_s: float) -> int | None:
        """Last lap of which a summary may tell; None at the flag."""
        log = show.session.log
        look = log.look_at(show.driver, until_s)
        return None if look is None or (log.over and until_s >= log.known_s) else look.lap
