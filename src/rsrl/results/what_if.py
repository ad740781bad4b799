"""The result of `rsrl replay --what-if`: what would have happened, beside what happened."""

from rsrl.results.base import Interval, Result


class WhatIfOption(Result, frozen=True, kw_only=True):
    """A course that a car might have taken from a lap on, over simulated futures.

    Attributes:
        name: asked, team or policy; call: in words.
        mean_position, positions: mean finishing position, and the share of futures finished 1st, 2nd ...
        places, seconds: mean change in finishing position and in race time against what the team did, in the same futures; below zero is
            better. `seconds` is over the futures in which the car reaches the flag in both.
        chance_gain, chance_lose: shares of futures with a better and with a worse finish than by what the team did.
        finished: share that reaches the flag.
        verdict: better, worse, equal or undecided; itself for what the team did.
    """

    name: str
    call: str
    mean_position: float
    positions: tuple[float, ...]
    places: float
    places_ci95: Interval
    seconds: float
    seconds_ci95: Interval
    chance_gain: float
    chance_lose: float
    finished: float
    verdict: str


class ReplayWhatIf(Result, frozen=True, kw_only=True):
    """What-if of one lap; the policy calls after each option's call in all futures.

    Attributes:
        lap: at whose end the call would have been carried out.
        races: futures, the same for all options.
        stops: of the team from this lap on, as (lap, compound); a compound is None where it is unknown.
        finish: place in which the car finished the real race; None where it did not.
    """

    lap: int
    driver: str
    races: int
    options: tuple[WhatIfOption, ...]
    stops: tuple[tuple[int, str | None], ...]
    finish: int | None = None
