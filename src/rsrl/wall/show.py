"""What one viewer sees: its session, car, clock and delay, and which messages are due.

Everything shown is what had been known at one race time, that of the viewer's clock less the delay: snapshots, history, calls, messages. So
no banner can give away what the delay holds back.
"""

import time
from collections.abc import Iterator
from typing import Final

from rsrl.wall.clock import ViewerClock
from rsrl.wall.messages import Clock, ClockCommand
from rsrl.wall.race_log import LAP_BEGINS, Look
from rsrl.wall.sessions import Session
from rsrl.wall.settings import View

FRAME_S: Final = 0.2
"""A viewer gets at most one snapshot in so long: the newest. What came between is never sent, so nothing queues up."""

SILENT_S: Final = 2.0
"""So often a viewer of a live race whose source is silent is told the age of what it sees."""

HISTORY_S: Final = 1.0
CLOCK_S: Final = 1.0


class Show:
    """One viewer at one session.

    Attributes:
        session, driver: watched.
        delay_s: broadcast delay.
    """

    def __init__(self, session: Session, driver: str, view: View) -> None:
        self.session, self.driver, self.delay_s = session, driver, view.delay_s
        self._source = view.source
        self.clock = ViewerClock()
        self.clock.speed = view.speed
        self.clock.seek(view.time_s + view.delay_s)
        self._paused_s: float | None = None
        if view.playing or session.live:
            self.clock.play(view.time_s + view.delay_s)
        self._look: Look | None = None
        self._sent_call: tuple[str, int, str] | None = None
        self.refresh()

    def refresh(self) -> None:
        """Send everything anew, as after a seek."""
        self._sent_frame = -1
        self._sent_history_s: float | None = None
        self._frame_at = self._history_at = self._clock_at = 0.0

    def choose(self, driver: str) -> None:
        """Look at another car."""
        self.driver, self._sent_call, self._look = driver, None, None
        self.session.follow(driver)

    def view(self) -> View:
        """As the log keeps it."""
        head = self.session.head
        driver = head.driven if head.kind == "simulated" else self.driver
        return View(
            source=self._source,
            race=head.race,
            driver=driver,
            seed=head.seed or 0,
            time_s=round(self.shown_s(), 1),
            speed=self.clock.speed,
            playing=self.clock.playing,
            delay_s=self.delay_s,
            car=self.driver,
        )

    def shown_s(self) -> float:
        """The race time that is shown."""
        log = self.session.log
        if self.session.live:
            now = log.now_s() if self._paused_s is None else self._paused_s
            return min(max(now - self.delay_s, 0.0), log.known_s)
        # the clock may run on after the end of the race until the delay has let the end through
        return max(self.clock.time_s(log.known_s + self.delay_s) - self.delay_s, 0.0)

    def wants(self, driver: str, look: int) -> bool:
        """Whether a look is shown, or comes next."""
        return driver == self.driver and self._look is not None and look in (self._look.number, self._look.number + 1)

    def due(self) -> Iterator[str]:
        """Messages that are due now, as JSON."""
        shown_s, wall_s = self.shown_s(), time.monotonic()
        log = self.session.log
        frame = log.frame_at(shown_s)
        if frame >= 0 and frame != self._sent_frame and wall_s - self._frame_at >= FRAME_S:
            if frame < self._sent_frame:
                self._sent_history_s = None
            self._sent_frame, self._frame_at = frame, wall_s
            yield log.frames[frame]
        elif frame >= 0 and self.session.live and frame == len(log.frames) - 1 and wall_s - self._frame_at >= SILENT_S:
            self._frame_at = wall_s  # the source is silent: how old the figures are is all that changes
            yield log.aged(max(log.now_s() - self.delay_s - log.known_s, 0.0))
        if frame >= 0 and wall_s - self._history_at >= HISTORY_S:
            self._history_at = wall_s
            # by the time of the snapshot, so that viewers who see the same snapshot share the text
            text = log.history_text(log.times_s[frame], self._sent_history_s)
            self._sent_history_s = log.times_s[frame]
            if text is not None:
                yield text
        yield from self._calls(shown_s)
        if wall_s - self._clock_at >= CLOCK_S:
            self._clock_at = wall_s
            if not self.session.live and log.over and shown_s >= log.known_s:
                self.clock.pause(log.known_s + self.delay_s)
            yield self.clock_message(shown_s).model_dump_json()

    def _calls(self, shown_s: float) -> Iterator[str]:
        """The call of the look that is shown, at once from the policy, then with its futures; the next look's are made ahead."""
        session = self.session
        look = session.log.look_at(self.driver, shown_s)
        if look is None:
            return
        self._look = look
        full = (self.driver, look.number, "full")
        if self._sent_call != full and (text := session.ready_call(self.driver, look, "full")) is not None:
            self._sent_call = full
            yield text
        if self._sent_call != full:
            text = session.call_text(self.driver, look, "policy")
            if text is not None and self._sent_call != (self.driver, look.number, "policy"):
                self._sent_call = (self.driver, look.number, "policy")
                yield text
            session.call_text(self.driver, look, "full")
            return
        looks = session.log.looks.get(self.driver, [])
        if look.number + 1 < len(looks):
            session.call_text(self.driver, looks[look.number + 1], "policy")
            session.call_text(self.driver, looks[look.number + 1], "full")

    def clock_message(self, shown_s: float | None = None) -> Clock:
        """The clock as it stands."""
        log = self.session.log
        time_s = self.shown_s() if shown_s is None else shown_s
        live = self.session.live
        known_s = time_s if live else log.known_s  # of a live race with a delay, what is held back is not known to the viewer
        starts = tuple(s for s in tuple(log.lap_starts_s) if s <= known_s)
        return Clock(
            session=self.session.name,
            playing=self._paused_s is None if live else self.clock.playing,
            time_s=round(time_s, 3),
            lap=log.lap_at(time_s),
            speed=self.clock.speed,
            known_s=round(known_s, 3),
            known_lap=max(len(starts), 1),
            lap_starts_s=starts,
            delay_s=self.delay_s,
            live=live,
        )

    def command(self, asked: ClockCommand) -> str:
        """Change the clock. Returns why not, or ""."""
        self._clock_at = 0.0
        if self.session.live:
            return self._live_command(asked)
        log, delay_s = self.session.log, self.delay_s
        known_s = log.known_s + delay_s
        match asked.command:
            case "play":
                self.clock.play(known_s)
            case "pause":
                self.clock.pause(known_s)
            case "speed":
                if asked.speed is None:
                    return "speed: give `speed`"
                self.clock.set_speed(asked.speed, known_s)
            case "seek":
                to_s = asked.time_s if asked.time_s is not None else None if asked.lap is None else self._lap_s(asked.lap)
                if to_s is None:
                    return "seek: give a `lap` of the race, or `time_s`"
                self._seek(to_s)
            case "step" | "back":
                self.clock.pause(known_s)
                self._seek(self._stepped_s(asked.command == "step"))
            case "live":
                return "live: this race is not live"
        return ""

    def _live_command(self, asked: ClockCommand) -> str:
        if asked.command == "pause":
            self._paused_s = self.session.log.now_s()
        elif asked.command in ("live", "play"):
            self._paused_s = None
            self.refresh()
        else:
            return f"{asked.command}: a live race has no clock to choose; there are pause and live"
        return ""

    def _seek(self, to_s: float) -> None:
        self.clock.seek(to_s + self.delay_s)
        self.refresh()

    def _lap_s(self, lap: int) -> float | None:
        """When the car began a lap, or else the leader."""
        begun_s, starts = self.session.log.lap_begun_s(self.driver, lap), self.session.log.lap_starts_s
        return begun_s if begun_s is not None else starts[lap - 1] if lap <= len(starts) else None

    def _stepped_s(self, forward: bool) -> float:
        """When the car's next lap begins, or its last one before this."""
        shown_s = self.shown_s()
        log = self.session.log
        begins = [look.time_s for look in log.looks.get(self.driver, []) if look.why == LAP_BEGINS] or log.lap_starts_s
        if forward:
            return min((s for s in begins if s > shown_s), default=log.known_s)
        before = [s for s in begins if s < shown_s]
        return before[-1] if before else 0.0

    def set_delay(self, delay_s: float) -> None:
        """Hold everything back by so much. More delay goes back in time: what has been seen already is shown again when it is due."""
        self.delay_s = delay_s
        self.refresh()
