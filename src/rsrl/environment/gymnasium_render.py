"""What `render()` of the Gymnasium environment shows: a line of text a lap, or the race trace so far as a picture."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.drawing import SERIES_COLOURS, STATUS_COLOURS, new_figure
from rsrl.drawing.race_trace import STATUS_NAMES
from rsrl.drawing.style import SOFT
from rsrl.environment.race_environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import COMPOUND_NAMES, GREEN
from rsrl.simulator import layout as at
from rsrl.state import Action

RENDER_MODES: Final = ("ansi", "rgb_array")
SIZE_IN: Final = (4.8, 3.2)
"""Width and height of a picture; with `DPI`, 480 by 320 pixels."""

DPI: Final = 100
MOST_BEHIND_S: Final = 100.0
"""A trace ends where a car falls further behind the leader."""

Frame = str | NDArray[np.uint8]


class RaceDisplay:
    """Watches the first race of an environment and shows it.

    Args:
        mode: one of `RENDER_MODES`.

    Raises:
        RsrlError: another mode.
    """

    def __init__(self, environment: RaceEnvironment, mode: str) -> None:
        if mode not in RENDER_MODES:
            raise RsrlError(f"unknown render mode {mode!r}; there are {', '.join(RENDER_MODES)}")
        self._environment = environment
        self._show: Callable[[], Frame] = self._line if mode == "ansi" else self._picture
        self.start()

    def start(self) -> None:
        """A race has been reset."""
        self._behind_s: list[NDArray[np.float64]] = []
        self._status: list[int] = []
        self._call: int | None = None
        self._coming = int(self._environment.races.r[0, at.R_STATUS])

    def lap(self, call: int) -> None:
        """A lap has been driven with this call."""
        self._call = call
        self._status.append(self._coming)
        self._behind_s.append(self._behind_leader_s())
        self._coming = int(self._environment.races.r[0, at.R_STATUS])

    def show(self) -> Frame:
        """The race as it stands: a line of text, or uint8 [height, width, 3]."""
        return self._show()

    def _behind_leader_s(self) -> NDArray[np.float64]:
        """Gap of each car to the leader, float64 [CARS]; NaN for those that are out, and for empty slots."""
        races = self._environment.races
        time_s = races.f[0, at.F_TIME].astype(np.float64)
        running = races.k[0, at.K_PLACE] < races.r[0, at.R_RUNNING]
        return np.where(running, time_s - time_s[races.k[0, at.K_ORDER, 0]], np.nan)

    def _line(self) -> str:
        """Lap, place, gaps, tyre with its age, track status and call; on the grid the grid place alone."""
        environment = self._environment
        k, car = environment.races.k[0], environment.car
        lap, place = int(environment.races.r[0, at.R_LAP]), int(k[at.K_PLACE, car])
        age = int(k[at.K_AGE, car])
        tyre = f"{COMPOUND_NAMES[k[at.K_COMPOUND, car]]} {age} lap{'' if age == 1 else 's'}"
        head = f"lap {lap:2}/{environment.laps}  P{place + 1:<2}"
        if self._call is None:
            return f"{head}  on the grid  {tyre}"
        status = STATUS_NAMES.get(self._status[-1], "green")
        return "  ".join((head, *self._gaps(place), tyre, status, str(Action(self._call)), *self._end()))

    def _gaps(self, place: int) -> tuple[str, str]:
        """Gaps to the cars ahead and behind, a dash where there is none."""
        order, gaps = self._environment.races.k[0, at.K_ORDER], self._behind_s[-1]
        running = int(self._environment.races.r[0, at.R_RUNNING])

        def gap(front: int, back: int) -> str:
            return f"{gaps[order[back]] - gaps[order[front]]:.1f} s" if front >= 0 and back < running else "-"

        return f"ahead {gap(place - 1, place):>7}", f"behind {gap(place, place + 1):>7}"

    def _end(self) -> tuple[str, ...]:
        if not self._environment.done[0]:
            return ()
        outcome = self._environment.outcome()
        position = int(outcome.position[0])
        if outcome.failed[0]:
            return ("no such set left: race over",)
        return (f"retired, P{position}" if outcome.retired[0] else f"finished P{position}",)

    def _picture(self) -> NDArray[np.uint8]:
        """Gap of every car to the leader by lap, the called car in front, bands where the race is neutralised."""
        environment = self._environment
        figure, (axes,) = new_figure(*SIZE_IN)
        figure.set_dpi(DPI)
        canvas: Any = figure.canvas
        for lap, status in enumerate(self._status, 1):
            if status != GREEN:
                axes.axvspan(lap - 0.5, lap + 0.5, color=STATUS_COLOURS[status], lw=0, zorder=0)
        if self._behind_s:
            gaps, laps = np.array(self._behind_s), np.arange(1, len(self._behind_s) + 1)
            axes.plot(laps, np.delete(gaps, environment.car, axis=1), color=SOFT, lw=0.5, marker="." if len(laps) == 1 else None)
            axes.plot(laps, gaps[:, environment.car], color=SERIES_COLOURS[0], lw=2.0, marker="." if len(laps) == 1 else None)
        axes.set_xlim(0.5, environment.laps + 0.5)
        axes.set_ylim(MOST_BEHIND_S, -2.0)
        axes.set_xlabel("lap")
        axes.set_ylabel("gap to the leader, s")
        axes.set_title(self._line(), loc="left", fontsize=5.5)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
