"""The result of `rsrl audit`: every dry race and car of a season, what its team's calls were worth, and who agrees with them."""

from rsrl.results.base import Interval, Number, Provenance, Result


class TeamStop(Result, frozen=True, kw_only=True):
    """A stop that a team made.

    Attributes:
        lap: at whose end; compound: S, M or H, None for an unknown or a wet set.
        track_status: 0 green, 1 virtual safety car, 2 safety car, 3 red flag, when it was called.
        first: whether it is the car's first.
        within_two_laps: by caller, the chance that it stops within two laps of it.
        same_compound: by caller, the chance that it would fit this compound on that lap; a caller is missing where that cannot be told.
    """

    lap: int
    compound: str | None = None
    track_status: int
    first: bool
    within_two_laps: dict[str, float]
    same_compound: dict[str, float]


class TeamCall(Result, frozen=True, kw_only=True):
    """A call of a team that differs from the policy's.

    Attributes:
        lap: at whose end; call, team: the two calls.
        places: mean change in finishing position by the team's call, the policy calling afterwards in both; above zero is lost. With ci95.
    """

    lap: int
    track_status: int
    call: str
    team: str
    places: float
    ci95: Interval


class CarAudit(Result, frozen=True, kw_only=True):
    """A car of a race.

    Attributes:
        laps, laps_called: driven, and with a call of the policy. illegal: calls of the policy that the rules do not allow.
        laps_agreed: on which the team did what the policy calls.
        not_possible: laps on which the team did what the state does not allow, such as fitting a set that it is taken not to have.
        uncalled: laps without a call by reason.
        differing: laps on which calls were rolled out.
        against_policy: by caller, places lost to the policy's calls over the race.
        regret: by caller, places lost to the best call made on each lap, chosen on one half of the futures and valued on the other.
        costliest, shrewdest: the call of the team that lost most and that gained most, of those whose interval excludes zero.
    """

    driver: str
    team: str
    position: int | None = None
    finished: bool
    laps: int
    laps_called: int
    laps_agreed: int
    illegal: int
    not_possible: int
    uncalled: dict[str, int]
    differing: int
    stops: tuple[TeamStop, ...]
    against_policy: dict[str, float]
    regret: dict[str, float]
    costliest: TeamCall | None = None
    shrewdest: TeamCall | None = None


class RaceAudit(Result, frozen=True, kw_only=True):
    """A race; what it rests on tells whether it can be used again.

    Attributes:
        race_hash, laps_hash: of the season file and of the lap table of the race.
        knows_race: whether the figures of the season file were fitted with this race among others.
    """

    race: str
    season: int
    round: int
    event: str
    model: str
    model_hash: str
    race_hash: str
    laps_hash: str
    rollouts: int
    seed: int
    knows_race: bool
    cars: tuple[CarAudit, ...]


class AuditMean(Result, frozen=True, kw_only=True):
    """A mean with its interval over races (of one race: over its cars); `of` so many of them."""

    mean: Number
    ci95: Interval
    of: int


class AuditedGroup(Result, frozen=True, kw_only=True):
    """A season, a race or a team.

    Attributes:
        cars: cars with at least one call; stops: first stops of the teams.
        laps_called, laps_agreed, illegal: sums.
        within_two_laps, same_compound: by caller, of first stops. against_policy, regret: by caller, places a car.
    """

    name: str
    races: int
    cars: int
    stops: int
    laps_called: int
    laps_agreed: int
    illegal: int
    within_two_laps: dict[str, AuditMean]
    same_compound: dict[str, AuditMean]
    against_policy: dict[str, AuditMean]
    regret: dict[str, AuditMean]


class AuditLeftOut(Result, frozen=True):
    """A race of the lap file that is not audited, and why."""

    race: str
    reason: str


class SeasonAudit(Result, frozen=True, kw_only=True):
    """The whole file.

    Attributes:
        callers: the policy first.
        more_often: by other caller, share of first stops matched within two laps, the policy's less its own, over races.
    """

    season: int
    model: str
    model_hash: str
    rollouts: int
    seed: int
    callers: tuple[str, ...]
    overall: AuditedGroup
    more_often: dict[str, AuditMean]
    by_race: tuple[AuditedGroup, ...]
    by_team: tuple[AuditedGroup, ...]
    left_out: tuple[AuditLeftOut, ...]
    races: tuple[RaceAudit, ...]
    provenance: Provenance | None = None
