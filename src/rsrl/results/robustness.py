"""`robustness.json`: a model among other rivals and with other figures, of `rsrl study robustness`."""

from rsrl.results.base import Interval, Provenance, Result


class Settings(Result, frozen=True):
    """What was run.

    Attributes:
        rivals: ways of calling the other cars.
        scales: of the errors in the figures, 0 for none; trained models have seen 0, or up to 1 where they trained on variants.
        draws: of the figures, at every scale but 0.
        races: in each setting, split over the draws and rounded up to a whole number for each.
        first_race: number of the first.
        informed: pit walls know the figures drawn; else they believe in the record's, and all their tables and plans are made of those.
    """

    rivals: tuple[str, ...]
    scales: tuple[float, ...]
    draws: int
    races: int
    first_race: int
    informed: bool


class Against(Result, frozen=True):
    """A strategist in a setting, against the model on the same races.

    Attributes:
        difference: its mean position less the model's; above zero the model finishes ahead.
        difference_ci95: Student's t over draws; at scale 0 over races.
        p_better: share of races the model finishes ahead, a tie counting half.
    """

    strategist: str
    mean_position: float
    difference: float
    difference_ci95: Interval | None
    p_better: float


class RobustnessRow(Result, frozen=True):
    """The model in a setting; `ci95` as in `Against`. At scale 0 there is one draw, the figures themselves."""

    rivals: str
    scale: float
    draws: int
    races: int
    mean_position: float
    ci95: Interval | None
    against: tuple[Against, ...]


class Robustness(Result, frozen=True):
    """The whole file; `model` as it was named on the command line."""

    race: str
    driver: str
    model: str
    seed: int
    plan: Settings
    rows: tuple[RobustnessRow, ...]
    provenance: Provenance
