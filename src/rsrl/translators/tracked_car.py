"""What is known of one car of a race that is followed: laps, crossings of the line, passages of the pit lane, stints."""

from dataclasses import dataclass, field
from typing import TypeVar

from rsrl.feeds import Gap

T = TypeVar("T")


@dataclass(slots=True)
class Stint:
    """A set of tyres on a car.

    Attributes:
        number: in the source's count, 1 for the set of the start.
        fitted_lap: laps that the car had completed when it was fitted.
        compound: S, M, H, I or W; None for unknown.
        laps_before: laps that the set had run when it was fitted; None for unknown.
        told: the source said so; False where it follows from a passage of the pit lane alone.
    """

    number: int
    fitted_lap: int
    compound: str | None
    new: bool | None
    laps_before: int | None
    told: bool = True


@dataclass(slots=True)
class Visit:
    """A passage of the pit lane at the end of lap `lap`, begun under a track status; `out_s` is None until the car leaves."""

    lap: int
    in_s: float
    status: int
    out_s: float | None = None

    @property
    def lane_s(self) -> float | None:
        """Time in the pit lane; None while it is there."""
        return None if self.out_s is None else self.out_s - self.in_s


@dataclass(slots=True)
class TrackedCar:
    """One car; laps count from 1, session times are in seconds.

    Attributes:
        laps: completed.
        crossings: time of crossing the line at the end of each lap that was seen.
        lap_times: as the source states them.
        gap, gap_at_s: the gaps last stated by the source, and when.
        sets_told: sets left as the source states them.
        seen_s: when the source last said anything of it on the track.
        out: retired, as the source says. disqualified: by race control.
        penalty_s: time penalties that have not been served.
    """

    number: int
    driver: str
    team: str | None = None
    grid: int | None = None
    laps: int = 0
    crossings: dict[int, float] = field(default_factory=dict)
    lap_times: dict[int, float] = field(default_factory=dict)
    stints: list[Stint] = field(default_factory=list)
    visits: list[Visit] = field(default_factory=list)
    position: int | None = None
    gap: Gap | None = None
    gap_at_s: float | None = None
    sets_told: tuple[int, int, int] | None = None
    seen_s: float = float("-inf")
    out: bool = False
    disqualified: bool = False
    penalty_s: float = 0.0

    @property
    def in_pit_lane(self) -> bool:
        """Whether the car is in the pit lane."""
        return bool(self.visits) and self.visits[-1].out_s is None

    def visit(self, lap: int) -> Visit | None:
        """The passage of the pit lane at the end of a lap."""
        return next((v for v in reversed(self.visits) if v.lap == lap), None)

    def stint_at(self, lap: int) -> Stint | None:
        """The set on the car after `lap` laps and the stop that may have ended them; None where no set was told."""
        fitted = [s for s in self.stints if s.fitted_lap <= lap]
        return fitted[-1] if fitted else (self.stints[0] if self.stints else None)

    def stops_until(self, lap: int) -> int:
        """Changes of tyres up to the end of a lap, those included that only the source's count of stints tells of."""
        if not self.stints:
            return 0
        before = self.stints[0].number - 1
        return before + max(sum(s.fitted_lap <= lap for s in self.stints) - 1, 0)

    def fit(self, told: Stint) -> bool:
        """Take in what the source says of a stint: a new set, or a correction. Returns whether the car's sets changed by it."""
        known = next((s for s in self.stints if s.number == told.number), None)
        if known is None:
            # a second set fitted on the same lap takes the place of the first, as behind a red flag
            self.stints = [s for s in self.stints if not (s.fitted_lap == told.fitted_lap > 0)]
            self.stints.append(told)
            self.stints.sort(key=lambda s: s.number)
            return True
        changed = (known.compound, known.laps_before) != (told.compound or known.compound, _first(told.laps_before, known.laps_before))
        known.compound = told.compound or known.compound
        known.new = _first(told.new, known.new)
        known.laps_before = _first(told.laps_before, known.laps_before)
        known.told = True
        return changed


def _first(new: T | None, old: T | None) -> T | None:
    """`new`, unless it is unknown."""
    return old if new is None else new
