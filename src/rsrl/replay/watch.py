"""A source followed for one car, event by event: season file and driver are settled as soon as the field is known, then calls are made."""

from typing import Final

from rsrl.errors import RsrlError
from rsrl.explanation import AnyPolicy
from rsrl.feeds import Event
from rsrl.replay.binding import Asked, Bound, DriverNotHeardOfError, bind, refuse_other_sessions
from rsrl.replay.caller import StateCaller
from rsrl.replay.follow import CarFollower, RaceFollower, Tell
from rsrl.translators import News, RaceTracker, TrackedStates

__all__ = ["CarWatch"]

FIELD_KNOWN_S: Final = 1.0
"""After the start, or the first lap heard of in a late join, cars may be heard of for the first time for so long."""


PATIENCE_S: Final = 300.0
"""A driver of whom nothing has been heard for so long, though laps were completed, is not in the race."""

OTHER_DISTANCE_SHARE: Final = 0.1
"""A race whose distance differs by more than this from the season file's is another one: a sprint, or a short race of a game."""


class CarWatch:
    """Follows a source for one car.

    Args:
        asked: race, driver and season file, as far as they were asked for.
        policy: calls where there is a season file; None follows without calls.
        stale_after_s: as of `RaceFollower`.
        tell: as of `RaceFollower`.

    Attributes:
        tracker: of the session that is on.
        bound: None until the field is known.
    """

    def __init__(self, asked: Asked, policy: AnyPolicy | None, stale_after_s: float | None = None, tell: Tell | None = None) -> None:
        self.asked, self.policy, self._stale_after_s, self._tell = asked, policy, stale_after_s, tell
        self.tracker = RaceTracker()
        self._begin()

    def _begin(self) -> None:
        self.bound: Bound | None = None
        self.caller: StateCaller | None = None
        self._follower: RaceFollower | None = None
        self._pending: list[tuple[News, ...]] = []
        self._known_s: float | None = None
        self._heard_first_s = 0.0

    @property
    def car(self) -> CarFollower | None:
        """The called car; None before the field is known."""
        return self._follower.cars[0] if self._follower else None

    @property
    def states(self) -> TrackedStates | None:
        """Makes states of any car; None before the field is known, and without a season file."""
        return self._follower.states if self._follower else None

    def take(self, event: Event) -> tuple[News, ...]:
        """Take in an event; what it changed.

        Raises:
            RsrlError: the session is no race; the race, the season file or the driver cannot be had.
        """
        if self._follower is None and self._known_s is not None and self.tracker.cars and event.time_s > self._known_s + FIELD_KNOWN_S:
            self._try_to_settle(event.time_s)
        if self._follower is not None:
            news = self._follower.take(event)
        else:
            news = self.tracker.take(event)
        if any(one.kind == "session" for one in news):
            self._begin()
            assert self.tracker.session is not None
            refuse_other_sessions(self.tracker.session)
        elif self._follower is None:
            self._pending.append(news)
            if self._known_s is None and any(one.kind in ("start", "lap") for one in news):
                self._known_s = self._heard_first_s = event.time_s
        return news

    def _try_to_settle(self, time_s: float) -> None:
        """Settle, unless the driver has not been heard of yet though others have, as at a restart that is joined late."""
        try:
            self.settle()
        except DriverNotHeardOfError:
            if time_s > self._heard_first_s + PATIENCE_S:
                raise
            self._known_s = time_s

    def _with_distance(self, bound: Bound) -> Bound:
        """Without season file where a feed is of another distance; a lap file has the laps that were driven, which is no distance."""
        record, laps = bound.record, self.tracker.total_laps
        if self._stale_after_s is None or record is None or laps is None or abs(laps / record.laps - 1) <= OTHER_DISTANCE_SHARE:
            return bound
        note = f"the race is over {laps} laps and the season file of {record.name} over {record.laps}: it is tracked without calls"
        return bound._replace(record=None, note=note)

    def settle(self) -> Bound:
        """Settle race, season file and driver by what is known now, and look at what has been heard so far.

        Raises:
            RsrlError: as `take`; or no car has been heard of at all.
        """
        if self.bound is not None:
            return self.bound
        if self.tracker.session is None or not self.tracker.cars:
            raise RsrlError("the source has told of no session with cars")
        self.bound = bound = self._with_distance(bind(self.asked, self.tracker))
        if bound.record is not None and self.policy is not None:
            self.caller = StateCaller(self.policy, bound.record, bound.record.car_index(bound.driver))
        callers = {bound.driver: self.caller}
        self._follower = RaceFollower(bound.record, callers, tracker=self.tracker, stale_after_s=self._stale_after_s, tell=self._tell)
        for news in self._pending:
            self._follower.note(news)
        self._pending = []
        return bound
