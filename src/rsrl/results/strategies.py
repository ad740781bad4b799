"""Strategies that were driven, as several results list them."""

from typing import Annotated

from msgspec import Meta

from rsrl.results.base import Result

Compound = Annotated[int, Meta(ge=0, le=2)]
"""Code of a compound: soft, medium, hard."""


class DrivenStrategy(Result, frozen=True):
    """A sequence of compounds that was driven in several races.

    Attributes:
        share: of the races finished.
        races: in which it was driven.
        compounds: codes, stint by stint.
        laps: median lap of each stop.
        windows: 10 % and 90 % quantile of the laps of each stop.
        mean_position: in those races.
        plan: compounds and laps as a plan is written, `S-H@14-S@36`.
    """

    share: float
    races: int
    compounds: tuple[Compound, ...]
    laps: tuple[int, ...]
    windows: tuple[tuple[int, int], ...]
    mean_position: float
    plan: str

    def __post_init__(self) -> None:
        if not len(self.laps) == len(self.windows) == len(self.compounds) - 1:
            raise ValueError("laps and windows have not one entry for each stop")


class CommonStrategy(DrivenStrategy, frozen=True):
    """One of the commonest strategies of a strategist."""

    strategist: str
