"""The call for one driver: what to do at the end of the lap under way, what it is worth, and what a strategist looks at beside it."""

from typing import Literal

from rsrl.wall.messages.base import Call, Driver, Interval, Marks, Message, Status, Strict

Verdict = Literal["itself", "better", "worse", "equal", "undecided"]
"""Of an option against the call: the difference is clear, or it is too small to matter, or the futures do not decide it."""


class OptionValue(Strict):
    """A legal call of this lap against the policy's own, in the same simulated futures.

    Attributes:
        value: the policy's own value of it, in `value_unit`; None for a policy without values.
        places: change in finishing position against the call, above zero worse; None before the futures are run, and for the call itself.
        points: the same in points.
        time_s: mean difference in race time to the flag.
        better, worse: shares of the futures with a better and a worse finish.
        mean_position: of the option.
    """

    call: Call
    label: str
    value: float | None
    places: Interval | None = None
    points: Interval | None = None
    time_s: float | None = None
    better: float | None = None
    worse: float | None = None
    mean_position: float | None = None
    verdict: Verdict | None = None


class Finish(Strict):
    """Finishing positions under the call: `shares[i]` is the share of futures that end in place i + 1."""

    shares: tuple[float, ...]
    mean: float
    finished: float


class GapCar(Strict):
    """A car on the gap chart.

    Attributes:
        gap_s: ahead of the chosen car below zero, behind it above; in race time.
        tyre_age_laps, compound: as fitted.
        pace_s: expected lap time against the chosen car's on the next lap, below zero quicker.
    """

    driver: Driver
    position: int
    gap_s: float
    compound: str
    tyre_age_laps: int
    pace_s: float


class PitLoss(Strict):
    """Mean loss of a stop of the chosen car under each status, s. Under a red flag a change is free."""

    green_s: float
    vsc_s: float
    sc_s: float


class Rejoin(Strict):
    """Where the car rejoins if it boxes at the end of this lap, over simulated futures.

    Attributes:
        compound: boxed for.
        position: median; low and high: 10 % and 90 % quantile.
        ahead, behind: the cars most often next to it at the line after the stop, with the share of futures in which they are.
        gap_ahead_s, gap_behind_s: median gaps to whoever is there.
        traffic_s: mean time lost behind other cars over the `traffic_laps` laps after the stop, with its interval, against staying in
            free air on the same tyres.
    """

    compound: Call
    position: int
    low: int
    high: int
    ahead: Driver | None
    ahead_share: float
    behind: Driver | None
    behind_share: float
    gap_ahead_s: float | None
    gap_behind_s: float | None
    traffic_s: Interval
    traffic_laps: int
    futures: int


class Duel(Strict):
    """The fight for place around the stops with one car.

    Attributes:
        kind: `undercut`: we box now and they a lap later; `overcut`: they box now and we two laps later; `undercut threat`: they box now
            and we a lap later; `overcut threat`: we box now and they two laps later.
        chance: share of futures in which the one who attacks is ahead once both have stopped; with its interval.
    """

    kind: Literal["undercut", "overcut", "undercut threat", "overcut threat"]
    rival: Driver
    gap_s: float
    chance: Interval
    futures: int


class StopOdds(Strict):
    """Chance that a rival stops by the end of this lap, of the next two and of the next four after it, if we stay out."""

    driver: Driver
    position: int
    within_1: float
    within_3: float
    within_5: float


class Window(Strict):
    """Laps at whose end a stop costs at most `margin_s` more than at the best one, with the track to oneself.

    Attributes:
        best_lap, compound: of the cheapest next stop; None where no stop is worth it.
    """

    first_lap: int | None
    last_lap: int | None
    best_lap: int | None
    compound: str | None
    margin_s: float


class CardEntry(Strict):
    """What to do if a neutralisation comes on this lap.

    Attributes:
        places: boxing against staying out, below zero boxing gains; None where only one is legal.
        verdict: of boxing against staying out.
        holds_until: last lap up to which the policy would make the same call if it came then, as long as the car stays out and on at
            least four in five futures; None where it holds to the end of what was looked at.
        looked_until: last lap that was looked at.
        double_stack_s: what boxing right behind the team mate would cost more; None where they do not meet.
    """

    status: Literal["vsc", "sc", "red"]
    call: Call
    places: Interval | None
    verdict: Literal["box", "stay out", "no difference", "only one call"]
    holds_until: int | None
    looked_until: int
    double_stack_s: float | None = None


class Training(Strict):
    """How far outside training the state is.

    Attributes:
        share: of the figures that the policy reads, those beyond its scale or what it was trained on.
        notes: what lies outside, a line each.
    """

    share: float
    figures: int
    notes: tuple[str, ...]


class CallMessage(Message):
    """The call of a driver for one lap.

    A lap's call is sent at once from the policy (`stage` policy), and again when its futures have been simulated (`stage` full); the blocks
    that need them are None before. A new call for the same lap replaces it, as when the track status changes.

    Attributes:
        lap: at whose end it would be carried out.
        look: number of the look at the race; a later look replaces an earlier one.
        time_s: session clock of what was known.
        call, words: None where no call can be made; `reason` says why.
        no_difference: the best other option is no worse than the call as far as the futures tell, or not by enough to matter.
        versus: the option that is compared: the best other one.
        lead: places by which it is worse than the call.
        done: what the car did at the end of the lap, where that is known already.
        took_ms: how long the server worked on this message.
    """

    type: Literal["call"] = "call"
    session: str
    driver: Driver
    lap: int
    look: int
    stage: Literal["policy", "full"]
    time_s: float
    why: str
    status: Status
    model: str
    value_unit: str
    call: Call | None
    words: str
    reason: str = ""
    no_difference: bool | None = None
    versus: Call | None = None
    lead: Interval | None = None
    options: tuple[OptionValue, ...] = ()
    futures: int = 0
    finish: Finish | None = None
    gaps: tuple[GapCar, ...] = ()
    pit_loss: PitLoss | None = None
    rejoin: Rejoin | None = None
    duels: tuple[Duel, ...] | None = None
    odds: tuple[StopOdds, ...] | None = None
    window: Window | None = None
    card: tuple[CardEntry, ...] | None = None
    training: Training | None = None
    missing: tuple[str, ...] = ()
    done: Literal["stay", "box"] | None = None
    took_ms: float = 0.0
    marks: Marks
