"""Rates of events by group (circuits, teams): gamma-Poisson, shrunk the less the more the groups differ."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import gammaln

from rsrl.season import Figure

STRENGTHS: Final = np.geomspace(0.7, 150.0, 60)  # of the prior of a group, in events at the common rate
USUAL_EVENTS: Final = 4.0  # that the usual rate counts as: seasons differ by about half
STRENGTH_PRIOR: Final = (np.log(6.0), 1.2)  # of its logarithm: a guess, for few data


@dataclass(frozen=True)
class Rates:
    """A common rate, and what is known of each group's multiple of it."""

    rate: float  # per unit of exposure
    events: float
    strength: float
    own: dict[str, tuple[float, float]]  # group to (events, events expected at the common rate)

    def factor(self, group: str) -> tuple[float, float]:
        """Multiple of the common rate of a group and its standard error; 1 with the whole spread for a group not seen."""
        events, expected = self.own.get(group, (0.0, 0.0))
        shape, total = self.strength + events, self.strength + expected
        return shape / total, float(np.sqrt(shape)) / total

    def at(self, group: str, what: str) -> Figure:
        """Rate of a group; `what` names the events in the note."""
        factor, se = self.factor(group)
        events, expected = self.own.get(group, (0.0, 0.0))
        common = 1.0 / np.sqrt(self.events + USUAL_EVENTS)
        note = f"{what}: {self.events:g} in all, {events:g} here where {expected:.1f} were usual; prior worth {self.strength:.1f}"
        return Figure(self.rate * factor, float(self.rate * np.hypot(se, factor * common)), int(self.events), note)


def pool_rates(counts: Mapping[str, tuple[float, float]], *earlier: Mapping[str, tuple[float, float]], usual: float) -> Rates:
    """Pool counts.

    Args:
        counts: (events, exposure) by group: these give the common rate, together with `usual`.
        usual: rate in earlier seasons, which counts for `USUAL_EVENTS`.
        earlier: the same of other times, whose common rates may differ (another era, wet races): they tell only how groups differ.
    """
    own: dict[str, tuple[float, float]] = {}
    for part in (*earlier, counts):
        rate = _common(part, usual)
        for group, (events, exposure) in part.items():
            before = own.get(group, (0.0, 0.0))
            own[group] = (before[0] + events, before[1] + rate * exposure)
    return Rates(_common(counts, usual), sum(e for e, _ in counts.values()), _strength(own), own)


def _common(counts: Mapping[str, tuple[float, float]], usual: float) -> float:
    """Events per unit of exposure, the usual rate added as so many events."""
    events, exposure = (sum(row[i] for row in counts.values()) for i in (0, 1))
    return (events + USUAL_EVENTS) / (exposure + USUAL_EVENTS / usual)


def _strength(own: Mapping[str, tuple[float, float]]) -> float:
    """Prior events that make the counts most likely (negative binomial), with a weak prior of its own."""
    y = np.array([e for e, _ in own.values()])
    e = np.array([x for _, x in own.values()])
    k = STRENGTHS[:, None]
    likely = (gammaln(k + y) - gammaln(k) + k * np.log(k) - (k + y) * np.log(k + e)).sum(axis=1)
    prior = -0.5 * ((np.log(STRENGTHS) - STRENGTH_PRIOR[0]) / STRENGTH_PRIOR[1]) ** 2
    weights = np.exp(likely + prior - np.max(likely + prior))
    return float(np.exp(np.sum(weights * np.log(STRENGTHS)) / weights.sum()))
