"""`evaluation.json`: the leaderboard of `rsrl evaluate` and `rsrl demo`, with what several training seeds come to together."""

from typing import Any

from rsrl.results.base import Interval, Number, Provenance, Result
from rsrl.results.strategies import CommonStrategy


class Row(Result, frozen=True, omit_defaults=False):
    """One strategist on the leaderboard.

    Attributes:
        strategist: its name.
        mean_position: mean finishing position, all races counted, retirements where they were classified.
        ci95: interval of it (Student's t over races).
        difference: mean over races of this strategist's position less the model's; above zero the model finishes ahead.
        difference_ci95: interval of it, from the paired differences (Student's t).
        p_better: share of races in which the model finishes ahead of this strategist, a tie counting half.
        mean_points: championship points a race.
        mean_stops: stops a race.
        invalid_share: share of races finished out of the rules; a retired car's do not count.
        retired_share: share of races not finished.
        decision_ms: time of one decision when a single race is called.
        gap_closed: share of the gap in mean position from `fixed` to `hindsight` that it closes; None without both of them.
        gap_closed_ci95: interval of it (delta method).
    """

    strategist: str
    mean_position: float
    ci95: Interval | None
    difference: float
    difference_ci95: Interval | None
    p_better: float
    mean_points: float
    mean_stops: float
    invalid_share: float
    retired_share: float
    decision_ms: float
    gap_closed: Number = None
    gap_closed_ci95: Interval | None = None


class Comparison(Result, frozen=True):
    """A strategist against all training seeds of a model on the same races.

    Attributes:
        difference: mean over seeds and races of its position less the model's; above zero the model finishes ahead.
        difference_ci95: interval over seeds and races (`mean_over_seeds`).
        p_better: chance that the model of some seed finishes ahead of it in a race, a tie counting half.
        p_better_ci95: bootstrap over seeds and races.
    """

    strategist: str
    difference: float
    difference_ci95: Interval | None
    p_better: float
    p_better_ci95: Interval | None


class Aggregate(Result, frozen=True):
    """Several training seeds of a model together.

    Attributes:
        seeds: how many.
        mean_position: over seeds and races; its interval by `mean_over_seeds`.
        iqm_position: interquartile mean over the seeds' mean positions; its interval by `stratified_bootstrap`.
        comparisons: one for each other strategist.
    """

    seeds: int
    mean_position: float
    mean_position_ci95: Interval | None
    iqm_position: float
    iqm_position_ci95: Interval | None
    comparisons: tuple[Comparison, ...]


class Training(Result, frozen=True):
    """How the policy of `rsrl demo` was trained."""

    pretrained: bool
    seconds: float | None
    seed: int
    steps: int


class Evaluation(Result, frozen=True, kw_only=True):
    """The whole file.

    Attributes:
        first_race: number of the first race.
        model: as it was named on the command line.
        training: of `rsrl demo` alone.
        warnings: where the race lies outside what the model was trained on, a line each.
        rows: best mean position first.
        aggregate: only where several seeds were evaluated.
        explanation: of `rsrl demo` alone, as `rsrl explain --json` has it.
        files: written beside this one.
        strategies: driven most often, by strategist.
    """

    race: str
    driver: str
    races: int
    seed: int
    first_race: int | None = None
    model: str | None = None
    training: Training | None = None
    warnings: tuple[str, ...] | None = None
    rows: tuple[Row, ...]
    aggregate: Aggregate | None = None
    provenance: Provenance
    explanation: dict[str, Any] | None = None
    files: tuple[str, ...] | None = None
    strategies: tuple[CommonStrategy, ...] | None = None
