"""The races that are being watched: each is followed once, however many watch it, and its calls are made once for a driver.

Nothing here blocks the event loop: sources are opened, races followed, calls made and explanations found by threads. Compiled code runs
without the interpreter lock, so a thread that simulates holds nobody up.
"""

import asyncio
import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from rsrl.errors import RsrlError
from rsrl.wall.catalogue import Catalogue
from rsrl.wall.messages import CallMessage, ErrorMessage, ExplanationMessage
from rsrl.wall.race_log import Look, RaceLog
from rsrl.wall.settings import Settings, View

if TYPE_CHECKING:
    from rsrl.explanation import AnyPolicy
    from rsrl.wall.calls import Stage
    from rsrl.wall.explanations import Asked
    from rsrl.wall.sources import Source

MOST_TEXTS: Final = 800
"""Calls kept as text; the oldest go first."""

MOST_ASKED: Final = 8
"""Explanations waited for at a time."""

LOOK_S: Final = 0.05
"""Who waits for the race to be known looks so often."""

log = logging.getLogger("rsrl.wall")

Tell = Callable[[int, int, str], None]


class Watcher(Protocol):
    """A viewer, as a session knows it."""

    def wants(self, driver: str, look: int) -> bool:
        """Whether the viewer still looks at a look of a driver, or will next."""
        ...

    def wake(self) -> None:
        """Something new is there. For the event loop."""
        ...


class Pools:
    """Threads by urgency: policies' calls, their futures, and what is asked for or opened."""

    def __init__(self) -> None:
        self.quick = ThreadPoolExecutor(1, "wall-call")
        self.slow = ThreadPoolExecutor(1, "wall-futures")
        self.asked = ThreadPoolExecutor(1, "wall-asked")

    def close(self) -> None:
        """Let what is under way end, and nothing else begin."""
        for pool in (self.quick, self.slow, self.asked):
            pool.shutdown(wait=False, cancel_futures=True)


class Session:
    """One race that is watched.

    Attributes:
        name: in all messages.
        head: of the source.
        log: of the race.
        watchers: viewers that watch it.
        used: number of the last time it was looked at, for making room.
    """

    def __init__(self, name: str, source: "Source", policy: "AnyPolicy", pools: Pools, loop: asyncio.AbstractEventLoop) -> None:
        from rsrl.wall.calls import Caller
        from rsrl.wall.explanations import Explainer
        from rsrl.wall.tape import Tape

        self.name, self.head, self.policy = name, source.head, policy
        self.log, self.watchers, self.used = RaceLog(name), set[Watcher](), 0
        self._source, self._tape, self._pools, self._loop = source, Tape(), pools, loop
        seed = source.head.seed or 0
        self._caller = Caller(name, policy, seed)
        self._explainer = Explainer(policy, seed, source.head.race_number)
        self._followed: set[str] = set()
        self._texts: dict[tuple[str, int, str], str] = {}
        self._pending: set[tuple[str, int, str]] = set()
        self._asked = 0
        self._woken = False

    @property
    def live(self) -> bool:
        """The race is happening now: there is no clock to choose."""
        return self.head.kind == "live"

    def start(self) -> None:
        """Begin to follow the source."""
        from rsrl.wall.follow import BoardFollower

        self._thread("tape", lambda: self._tape.record(self._source))
        self._thread("board", BoardFollower(self._source, self._tape, self.log, self._changed).run)

    def follow(self, driver: str) -> None:
        """Begin to look at a car, if nobody has yet."""
        from rsrl.wall.follow import LookFollower

        if driver not in self._followed:
            self._followed.add(driver)
            self._thread(driver, LookFollower(self._source, self._tape, self.log, driver, self._changed).run)

    async def reached(self, driver: str, time_s: float, lap: int | None) -> float:
        """The race time at which a view is to begin, once the race is known so far: a driver's lap, or a time."""
        while True:
            begun_s = time_s if lap is None else self.log.lap_begun_s(driver, lap)
            if self.live or self.log.over or self.log.failed or (begun_s is not None and self.log.known_s >= begun_s):
                return time_s if begun_s is None else begun_s
            await asyncio.sleep(LOOK_S)

    def close(self) -> None:
        """End its threads."""
        self._tape.stop()

    def _thread(self, what: str, run: Callable[[], None]) -> None:
        def guarded() -> None:
            try:
                run()
            except Exception as error:  # a fault of ours must not leave viewers waiting without a word
                log.exception("%s of %s", what, self.name)
                self.log.failed = f"the race cannot be followed further: {type(error).__name__}"
                self._changed()

        threading.Thread(target=guarded, name=f"wall-{self.name}-{what}", daemon=True).start()

    def _changed(self) -> None:
        """Wake the viewers; from any thread, however often: once until they have been woken."""
        if not self._woken and not self._loop.is_closed():
            self._woken = True
            self._loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        self._woken = False
        for watcher in self.watchers:
            watcher.wake()

    def ready_call(self, driver: str, look: Look, stage: "Stage") -> str | None:
        """The call for a look as JSON if it has been made."""
        return self._texts.get((driver, look.number, stage))

    def call_text(self, driver: str, look: Look, stage: "Stage") -> str | None:
        """The call for a look as JSON, the same text for all viewers; None while it is being made, which this begins."""
        key = (driver, look.number, stage)
        text = self._texts.get(key)
        if text is None and key not in self._pending:
            self._pending.add(key)
            pool = self._pools.quick if stage == "policy" else self._pools.slow
            made = self._loop.run_in_executor(pool, self._make_call, driver, look, stage)
            made.add_done_callback(lambda future: self._called(key, future))
        return text

    def _make_call(self, driver: str, look: Look, stage: "Stage") -> str | None:
        if stage == "full" and not any(watcher.wants(driver, look.number) for watcher in tuple(self.watchers)):
            return None  # everybody has gone on meanwhile
        return self.make_call(driver, look, stage).model_dump_json()

    def make_call(self, driver: str, look: Look, stage: "Stage") -> CallMessage:
        """The call for a look; slow, for a thread. A state that nothing can be said of gives a call message with the reason."""
        try:
            return self._caller.call(driver, look, stage)
        except RsrlError as error:
            return self._caller.call(driver, look.without_moment(str(error)), stage)

    def _called(self, key: tuple[str, int, str], future: "asyncio.Future[str | None]") -> None:
        self._pending.discard(key)
        if future.cancelled():
            return
        if error := future.exception():
            log.error("call of %s: %r", key, error, exc_info=error)
            return
        text = future.result()
        if text is not None:
            self._texts[key] = text
            while len(self._texts) > MOST_TEXTS:
                del self._texts[next(iter(self._texts))]
            self._wake()

    async def asked_call(self, driver: str, look: Look, until_s: float) -> str:
        """The call of an earlier lap with what the car then did, as far as that is known by a time."""
        made = await self._loop.run_in_executor(self._pools.asked, self.make_call, driver, look, "full")
        done = self.log.done(driver, look.lap, until_s)
        return made.model_copy(update={"done": None if done is None else "box" if done else "stay"}).model_dump_json()

    async def explain(self, asked: "Asked", look: Look, tell: Tell, until_lap: int | None) -> ExplanationMessage | ErrorMessage:
        """An explanation, or why there is none; a summary of laps up to `until_lap`. `tell` is called from another thread."""
        if self._asked >= MOST_ASKED:
            return ErrorMessage(code="busy", text="too many explanations are being waited for; ask again", request=asked.request)
        self._asked += 1
        try:
            return await self._loop.run_in_executor(self._pools.asked, self._explain, asked, look, tell, until_lap)
        except RsrlError as error:
            return ErrorMessage(code="failed", text=str(error), request=asked.request)
        except Exception as error:  # a fault of ours is answered, and the log says what it was
            log.exception("explanation %s", asked.method)
            return ErrorMessage(code="failed", text=f"the explanation failed: {type(error).__name__}", request=asked.request)
        finally:
            self._asked -= 1

    def _explain(self, asked: "Asked", look: Look, tell: Tell, until_lap: int | None) -> ExplanationMessage:
        if look.moment is None:
            raise RsrlError(look.reason or "there was no call to explain on this lap")
        return self._explainer.explain(asked, look.moment(), tell, until_lap)


class _Key(NamedTuple):
    source: str
    race: str
    driver: str | None
    seed: int


class Sessions:
    """All sessions of a server."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.catalogue = Catalogue(settings)
        self._pools = Pools()
        self._open: dict[_Key, asyncio.Task[Session]] = {}
        self._count = self._uses = 0
        self._policy: Any = None
        self._lock = threading.Lock()

    async def open(self, view: View) -> Session:
        """The session of a view, opened if nobody watches it yet.

        Raises:
            RsrlError: there is no such race, driver or source, or no room for another session.
        """
        key = _Key(view.source, view.race, view.driver if view.source == "simulated" else None, view.seed)
        task = self._open.get(key)
        if task is None:
            self._make_room()
            self._count += 1
            task = self._open[key] = asyncio.create_task(self._opened(view, f"s{self._count}"))
        try:
            session = await asyncio.shield(task)
        except RsrlError:
            self._open.pop(key, None)
            raise
        self._uses += 1
        session.used = self._uses
        return session

    async def _opened(self, view: View, name: str) -> Session:
        loop = asyncio.get_running_loop()
        session = await loop.run_in_executor(self._pools.asked, self._make, view, name, loop)
        session.start()
        return session

    def _make(self, view: View, name: str, loop: asyncio.AbstractEventLoop) -> Session:
        policy = self.policy()
        return Session(name, self.catalogue.source(view, policy), policy, self._pools, loop)

    def policy(self) -> "AnyPolicy":
        """The policy, loaded once; slow the first time, since all that simulates is imported with it."""
        from rsrl.explanation import load_any_policy

        with self._lock:
            if self._policy is None:
                self._policy = load_any_policy(self.settings.model)
        return self._policy

    def _make_room(self) -> None:
        """Close the session that nobody has looked at for longest. Raises RsrlError where all are watched."""
        if len(self._open) < self.settings.sessions:
            return
        idle = [(task.result().used, key) for key, task in self._open.items() if _is_idle(task)]
        if not idle:
            raise RsrlError(f"{len(self._open)} races are being watched, which is the most; join one of them")
        self._open.pop(min(idle)[1]).result().close()

    def close(self) -> None:
        """End all threads."""
        for task in self._open.values():
            if task.done() and not task.cancelled() and task.exception() is None:
                task.result().close()
        self._pools.close()


def _is_idle(task: "asyncio.Task[Session]") -> bool:
    if not task.done() or task.cancelled() or task.exception() is not None:
        return False
    session = task.result()
    return not session.watchers and not session.live  # a live source can be read once only
