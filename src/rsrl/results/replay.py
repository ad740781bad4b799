"""Results of replaying a real race: `rsrl replay --json`."""

from typing import Any

from rsrl.results.base import Interval, Number, Provenance, Result
from rsrl.results.what_if import ReplayWhatIf


class ReplayHealth(Result, frozen=True):
    """How far what was known can be trusted, as of `rsrl.translators.Health`."""

    age_s: float
    gaps: dict[str, int]
    fields: dict[str, str]
    missing: tuple[str, ...]
    unheard: tuple[str, ...]


class ReplayLook(Result, frozen=True):
    """One look at the race on a lap: when, why, and the call; `call` is None where none could be made, `reason` says why."""

    time_s: float
    why: str
    track_status: int
    call: str | None = None
    reason: str | None = None
    confidence: str | None = None


class ReplayLap(Result, frozen=True, kw_only=True):
    """A lap of the called car.

    Attributes:
        lap: the lap, at the end of which the call would be carried out.
        looks: at the race in the course of the lap.
        position, gap_to_leader_s, gap_ahead_s, gap_behind_s: as the lap began; None where unknown, or where there is no such car.
        compound, tyre_age_laps, stops: on the car; None for an unknown tyre.
        track_status: 0 green, 1 virtual safety car, 2 safety car, 3 red flag, at the look that counts.
        call, values, legal: of the look that counts; values by call, where the policy has them.
        confidence: of the call: high, close (another call is worth nearly as much), low (data are incomplete) or none; `doubts` say why.
        reason: why there is no call.
        team: what the team did at the end of the lap, in the words of the calls; None where that is unknown. Under a red flag a change of
            tyres counts for the lap on which the flag came.
        agrees: whether call and team are the same.
        health: of the look that counts; None without a season file.
        state: what was known at the look that counts, which `rsrl explain --state` reads; None without a call.
    """

    lap: int
    looks: tuple[ReplayLook, ...]
    position: int | None = None
    gap_to_leader_s: Number = None
    gap_ahead_s: Number = None
    gap_behind_s: Number = None
    compound: str | None = None
    tyre_age_laps: int | None = None
    stops: int = 0
    track_status: int
    call: str | None = None
    values: dict[str, float] | None = None
    legal: tuple[str, ...] = ()
    confidence: str | None = None
    doubts: tuple[str, ...] = ()
    reason: str | None = None
    team: str | None = None
    agrees: bool | None = None
    health: ReplayHealth | None = None
    state: dict[str, Any] | None = None


class LiveLook(Result, frozen=True, kw_only=True):
    """One look at a race that is followed: when, why, and the lap under way as it was known then, with the call.

    Attributes:
        time_s: session time, s.
        driver: whose car is called.
        seen: `looks`, `team` and `agrees` are not known yet.
    """

    time_s: float
    why: str
    driver: str
    seen: ReplayLap


class AuditedLap(Result, frozen=True, kw_only=True):
    """A lap on which call and team differed, rolled out from what was known then.

    Attributes:
        call, team: the two calls.
        places: mean change in finishing position by the team's call against the policy's, the policy calling afterwards in both; above
            zero the policy's call was worth more.
        ci95: interval of that mean.
        verdict: on the team's call: better, worse, equal or undecided; "not possible" where the state does not allow it, as when the sets
            left are estimated wrongly.
    """

    lap: int
    call: str
    team: str
    places: Number = None
    ci95: Interval | None = None
    verdict: str


class AuditedStop(Result, frozen=True, kw_only=True):
    """A stop that the team made, and when the policy would have made it.

    Attributes:
        lap, compound: of the team's stop.
        policy_lap: lap of the policy's stop: the first of the lap of the team's stop and the two before on which it called to box; else the
            mean lap of its next stop over the futures in which the car stays out. None if it does not stop in half of them.
        policy_compound: that it called to box for, on that lap or, staying out, would box for at once.
        within_two_laps, same_compound: whether they match.
    """

    lap: int
    compound: str
    track_status: int
    policy_lap: Number = None
    policy_compound: str | None = None
    within_two_laps: bool
    same_compound: bool


class ReplayAudit(Result, frozen=True, kw_only=True):
    """Calls against what the team did; `races` futures each. Futures are simulated, so the verdicts are the simulator's, not history's."""

    races: int
    laps_called: int
    laps_agreed: int
    differences: tuple[AuditedLap, ...]
    stops: tuple[AuditedStop, ...]
    stops_within_two_laps: int
    compounds_matched: int


class ReplayResult(Result, frozen=True, kw_only=True):
    """A race replayed for one car.

    Attributes:
        source: the file.
        race: name, such as `bahrain-2023`; event and season as the source has them.
        model, model_hash: of the policy; None for a race that is tracked without calls, `note` says why.
        finished: whether the car took the flag.
        laps: in order.
    """

    source: str
    race: str
    event: str
    season: int
    driver: str
    model: str | None = None
    model_hash: str | None = None
    note: str | None = None
    total_laps: int | None = None
    finished: bool
    laps: tuple[ReplayLap, ...]
    audit: ReplayAudit | None = None
    what_if: ReplayWhatIf | None = None
    provenance: Provenance | None = None
