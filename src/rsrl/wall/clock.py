"""The clock of one viewer: race time that runs at its own speed, and stands still when it is told to or the race is not known further."""

import time
from collections.abc import Callable


class ViewerClock:
    """Race time of a viewer, s.

    Attributes:
        speed: seconds of the race a second.
        playing: it runs.

    Args:
        now: wall clock in s.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._race_s, self._wall_s = 0.0, now()
        self.speed, self.playing = 1.0, False

    def time_s(self, known_s: float) -> float:
        """The race time, not beyond what is known: a clock that gets there waits, and one that was set further gets there in time."""
        if self.playing:
            wall_s = self._now()
            ran_s = self._race_s + (wall_s - self._wall_s) * self.speed
            self._race_s, self._wall_s = max(self._race_s, min(ran_s, known_s)), wall_s
        return min(self._race_s, known_s)

    def play(self, known_s: float) -> None:
        """Let it run."""
        self.time_s(known_s)
        self._wall_s, self.playing = self._now(), True

    def pause(self, known_s: float) -> None:
        """Stop it."""
        self.time_s(known_s)
        self.playing = False

    def seek(self, time_s: float) -> None:
        """Go to a race time."""
        self._race_s, self._wall_s = max(time_s, 0.0), self._now()

    def set_speed(self, speed: float, known_s: float) -> None:
        """Change the speed."""
        self.time_s(known_s)
        self.speed = speed
