"""What `rsrl live` shows: the call, how far it can be trusted, the field, and race control."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from rsrl.cli.replay_tables import SHORT, STATUS
from rsrl.results import LiveLook

if TYPE_CHECKING:
    from rsrl.feeds.anomalies import Anomalies
    from rsrl.live import Moment
    from rsrl.translators import RaceTracker, TrackedCar

__all__ = ["LiveView", "closing_lines", "field_rows", "look_line", "picture"]

FRAMES_PER_S: Final = 8.0
"""The view is drawn anew so often at most, and at once when there is a new call."""

MESSAGES: Final = 3
STYLES: Final = {"high": "bold green", "close": "bold yellow", "low": "bold yellow", "none": "bold red"}


class LiveView:
    """The view on a terminal; a context."""

    def __init__(self, console: Console | None = None) -> None:
        self._live = Live(console=console, auto_refresh=False, screen=False, vertical_overflow="crop")
        self._drawn_s = float("-inf")
        self._look: LiveLook | None = None

    def __enter__(self) -> "LiveView":
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def show(self, moment: "Moment") -> None:
        """Show a moment."""
        if moment.looks:
            self._look = moment.looks[-1]
        if moment.looks or time.monotonic() - self._drawn_s >= 1 / FRAMES_PER_S:
            self._drawn_s = time.monotonic()
            self._live.update(picture(moment, self._look), refresh=True)


def picture(moment: "Moment", look: LiveLook | None) -> Group:
    """The view of a moment, with the last look at the race."""
    messages = [Text(message.text, style="dim", no_wrap=True) for message in moment.tracker.messages[-MESSAGES:]]
    return Group(_headline(moment), _call(moment, look), _field(moment), *messages)


def _headline(moment: "Moment") -> Text:
    tracker, session = moment.tracker, moment.tracker.session
    event = f"{session.event or 'unnamed race'} {session.season or ''}".strip() if session else "no session yet"
    lap = f"lap {min(tracker.leader_laps + 1, tracker.total_laps or 999)}" + (f" of {tracker.total_laps}" if tracker.total_laps else "")
    hours, rest = divmod(int(max(moment.clock_s, 0)), 3600)
    data = f"STALE, no car heard of for {tracker.age_s:.0f} s" if moment.stale else f"data {tracker.age_s:.0f} s old"
    status = {"": "green"}.get(STATUS[tracker.status], STATUS[tracker.status])
    clock = f"{hours}:{rest // 60:02}:{rest % 60:02}"
    line = Text(f"{event}   {lap}   {clock}   ", no_wrap=True)
    line.append(status, style="bold" if tracker.status else "")
    line.append("   ")
    line.append(data, style="bold red" if moment.stale else "dim")
    return line


def _call(moment: "Moment", look: LiveLook | None) -> Panel:
    bound = moment.watch.bound
    title = f"{bound.driver}" if bound else "waiting for the field"
    lines = []
    if moment.stale:
        lines.append(Text("no call: the data are stale", style="bold red"))
    elif look is not None:
        lines += _call_lines(look)
    if bound is not None and bound.note:
        lines.append(Text(bound.note, style="dim"))
    return Panel(Group(*lines) if lines else Text("no call yet", style="dim"), title=title, title_align="left")


def _call_lines(look: LiveLook) -> Iterator[Text]:
    seen = look.seen
    level = seen.confidence or "none"
    call = SHORT[seen.call] if seen.call else f"no call: {seen.reason}"
    text = Text(f"lap {seen.lap}: ")
    text.append(call, style=STYLES[level])
    if seen.call:
        text.append(f"   confidence {level}")
    yield text
    if seen.values:
        values = (f"{SHORT[name]} {value:.2f}" for name, value in seen.values.items() if name in seen.legal)
        yield Text("values: " + ", ".join(values), style="dim")
    for doubt in seen.doubts:
        yield Text(doubt, style="yellow")
    if seen.health:
        gaps = ", ".join(f"{n} {source}" for source, n in seen.health.gaps.items())
        yield Text(f"{look.why}; gaps: {gaps or 'none'}", style="dim")


def _field(moment: "Moment") -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("", "driver", "gap", "lap", "last lap", "tyre", "stops", ""):
        table.add_column(name, justify="left" if name in ("driver", "") else "right", no_wrap=True)
    bound = moment.watch.bound
    for row in field_rows(moment.tracker):
        table.add_row(*row, style="bold" if bound and row[1] == bound.driver else "")
    return table


def field_rows(tracker: "RaceTracker") -> list[tuple[str, ...]]:
    """The field in order, as the source has it: place, driver, gap, laps, last lap, tyre and its age, stops, pit lane or out."""
    cars = sorted(tracker.cars.values(), key=lambda car: (tracker.is_out(car), car.position or 99, -car.laps))
    return [_row(tracker, place, car) for place, car in enumerate(cars, 1)]


def _row(tracker: "RaceTracker", place: int, car: "TrackedCar") -> tuple[str, ...]:
    stint, last_s = car.stint_at(car.laps), car.lap_times.get(car.laps)
    out = tracker.is_out(car)
    age = "" if stint is None or stint.laps_before is None else str(stint.laps_before + max(car.laps - stint.fitted_lap, 0))
    tyre = "" if stint is None else f"{stint.compound or '?'} {age or '?'}"
    word = "out" if out else "pit" if car.in_pit_lane else ""
    lap_time = "" if last_s is None else f"{int(last_s // 60)}:{last_s % 60:06.3f}"
    gap = "" if out else _gap(tracker, car)
    return "" if out else str(place), car.driver, gap, str(car.laps), lap_time, tyre, str(car.stops_until(car.laps)), word


def _gap(tracker: "RaceTracker", car: "TrackedCar") -> str:
    """The gap to the leader at the last crossing of the line, or as the source states it."""
    led_s = tracker.led_s(car.laps)
    if car.laps in car.crossings and led_s is not None and car.laps >= tracker.leader_laps - 1:
        return f"{car.crossings[car.laps] - led_s:.1f}"
    if car.gap is not None and car.gap.gap_to_leader_s is not None:
        return f"{car.gap.gap_to_leader_s:.1f}"
    down = tracker.leader_laps - car.laps
    return f"+{down} lap{'s' if down > 1 else ''}" if down > 0 else ""


def look_line(look: LiveLook) -> str:
    """A look on one line, for where there is no terminal."""
    seen = look.seen
    place = "" if seen.position is None else f"P{seen.position}"
    tyre = f"{seen.compound or '?'}{'?' if seen.tyre_age_laps is None else seen.tyre_age_laps}"
    call = f"{SHORT[seen.call]}, confidence {seen.confidence}" if seen.call else f"no call: {seen.reason or 'tracked only'}"
    status = STATUS[seen.track_status]
    return " ".join(word for word in (f"lap {seen.lap}", look.driver, place, tyre, status, f"[{look.why}]", call) if word)


def closing_lines(moment: "Moment", anomalies: "Anomalies", log: Path | None) -> Iterator[str]:
    """What is said at the end."""
    tracker, watch = moment.tracker, moment.watch
    over = "the session is over" if tracker.over else "the session goes on"
    follower = watch.car
    calls = sum(look.called is not None for lap in follower.laps for look in lap.looks) if follower else 0
    driver = f", {calls} calls for {watch.bound.driver}" if watch.bound else ""
    yield f"{over}: {tracker.leader_laps} laps{driver}"
    if watch.bound is not None and watch.bound.note:
        yield watch.bound.note
    if anomalies.counts:
        yield f"left out of the source: {anomalies.summary()}"
    if log is not None:
        yield f"log: {log}"
