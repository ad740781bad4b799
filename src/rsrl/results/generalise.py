"""`generalise.json`: strategists on the same races of several Grands Prix, of `rsrl study generalise`."""

from typing import Final, Literal

from rsrl.results.base import Interval, Number, Provenance, Result
from rsrl.results.strategies import CommonStrategy

FORMAT: Final = 1
"""Of the file; a study in another format is refused."""


class Race(Result, frozen=True):
    """A Grand Prix of the study.

    Attributes:
        code: of three letters, as the paper's Table 3 has it.
        unseen: no model of the paper's study trains on its track.
    """

    race: str
    track: str
    code: str
    event: str
    season: int
    laps: int
    driver: str
    unseen: bool


class RaceRow(Result, frozen=True):
    """One strategist at one race.

    Attributes:
        races: number of races it called.
        mean_position: with its interval, adjusted to the races of the strategist that called most (`comparable_mean`).
        own_mean_position: over the races it called.
        trained: it trained at this track.
        best: it has the best mean of the race among strategists that do not know the future.
    """

    strategist: str
    race: str
    races: int
    mean_position: float
    ci95: Interval | None
    own_mean_position: float
    mean_points: float
    mean_stops: float
    invalid_share: float
    retired_share: float
    decision_ms: float
    trained: bool
    best: bool


class Average(Result, frozen=True):
    """Mean position of a strategist over tracks; `over` is all, seen, unseen, trained or untrained."""

    strategist: str
    over: str
    tracks: int
    mean_position: float
    ci95: Interval | None


class Difference(Result, frozen=True):
    """Places by which one strategist is behind another on the same races, below zero where it is ahead.

    Attributes:
        difference: mean over `races`.
        ci95: by Student's t.
        p_ahead: share of races in which the other finishes ahead, a tie counting half, with its interval `p_ci95`.
    """

    difference: float
    ci95: Interval | None
    p_ahead: float
    p_ci95: Interval | None
    races: int


class ModelDifference(Difference, frozen=True):
    """How far the best baseline of a race is behind a model."""

    strategist: str


class TrackDifference(Difference, frozen=True):
    """How far a strategist is behind the reference model `against`, at a race or over a group of `tracks`."""

    strategist: str
    against: str
    race: str
    tracks: int


class BestBaseline(Result, frozen=True):
    """The best baseline of a race, and each model against it."""

    race: str
    baseline: str
    models: tuple[ModelDifference, ...]


class CriteriaShares(Result, frozen=True):
    """Shares of the races finished that meet each criterion."""

    few_stops: float
    harder_longer: float
    like_or_better: float | None
    reasonable: float | None
    harder_longer_a_set: float


class Verdict(Result, frozen=True):
    """The paper's criteria of a reasonable strategy, held against the commonest one.

    Attributes:
        strategy: as a plan is written.
        share: of the races finished.
        few_stops, harder_longer, like_or_better: criteria 1 to 3; the third is None without a baseline to compare with.
        reasonable: all three.
        harder_longer_a_set: the second by laps a set.
        similar_to, better_than: names of baselines.
        shares: of the races finished that meet each.
    """

    strategy: str
    share: float
    few_stops: bool
    harder_longer: bool
    like_or_better: bool | None
    reasonable: bool | None
    harder_longer_a_set: bool
    similar_to: tuple[str, ...]
    better_than: tuple[str, ...]
    shares: CriteriaShares


class Criteria(Verdict, frozen=True):
    """The verdict on a strategist at a race."""

    strategist: str
    race: str


class TrackStrategy(CommonStrategy, frozen=True):
    """A common strategy at a race; `text` is written as in the paper, `S[10,20]M`."""

    race: str
    text: str


class GapClosed(Result, frozen=True):
    """Share of the gap from `fixed` to `hindsight` that a strategist closes, at a race or over all `tracks`."""

    strategist: str
    race: str
    tracks: int
    share: Number
    ci95: Interval | None


class Scored(Result, frozen=True):
    """Scores of the races of one table."""

    races: tuple[Race, ...]
    table: tuple[RaceRow, ...]
    averages: tuple[Average, ...]
    differences: tuple[TrackDifference, ...]
    best_baselines: tuple[BestBaseline, ...]
    criteria: tuple[Criteria, ...]
    strategies: tuple[TrackStrategy, ...]
    gap_closed: tuple[GapClosed, ...]


class Participant(Result, frozen=True):
    """A strategist of the study: its kind, the races it calls at a track, and of a model the races it trained on and its hash."""

    strategist: str
    kind: Literal["model", "baseline", "bound"]
    races: int
    trained_on: tuple[str, ...]
    model_hash: str | None


class CarRow(Result, frozen=True):
    """One car called by a strategist and by the reference model."""

    driver: str
    grid: int
    mean_position: float
    reference_mean_position: float
    difference: float
    ci95: Interval | None
    p_ahead: float


class Cars(Result, frozen=True):
    """Every car of a race called in turn by a strategist, against the reference model.

    Attributes:
        ahead: cars with which the model has the better mean.
        surely_ahead, surely_behind: cars for which the interval of the difference excludes zero.
        difference: mean over cars and `races`.
    """

    race: str
    strategist: str
    against: str
    cars: int
    ahead: int
    surely_ahead: int
    surely_behind: int
    difference: float
    ci95: Interval | None
    races: int
    by_car: tuple[CarRow, ...]


class LeftOut(Result, frozen=True):
    """A strategist that could not call a race, and why."""

    strategist: str
    race: str
    reason: str


class StudyResult(Result, frozen=True, kw_only=True):
    """The whole file.

    Attributes:
        first_race: number of the first race.
        driver: whose car was called; None for each race's default driver.
        reference: the model that others are compared with; None without models.
        held_out: races of another season; None where they were not asked for.
    """

    study: str
    format: int
    seed: int
    first_race: int
    driver: str | None
    reference: str | None
    strategists: tuple[Participant, ...]
    tracks: Scored
    held_out: Scored | None
    cars: tuple[Cars, ...]
    left_out: tuple[LeftOut, ...]
    files: tuple[str, ...] = ()
    provenance: Provenance
