"""Race plans: what to start on, when to stop and for what. `S-H@14-S@36` boxes at the end of laps 14 and 36."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import layout as at

_STOP: Final = re.compile(r"([A-Z])@(\d{1,3})")


@dataclass(frozen=True, order=True)
class Plan:
    """A plan: `compounds` codes stint by stint, `laps` the last lap of each stint but the final one.

    `sc_window_laps` and `vsc_window_laps`: under a safety car (or a virtual one) the next planned stop is taken at
    once if it is at most so many laps ahead; 0 keeps to the plan.
    """

    compounds: tuple[int, ...]
    laps: tuple[int, ...]
    sc_window_laps: int = 0
    vsc_window_laps: int = 0

    @classmethod
    def parse(cls, text: str) -> "Plan":
        """Read `S-H@14-S@36`; raises RsrlError where it is not a plan."""
        start, *stops = text.strip().upper().split("-")
        matches = [_STOP.fullmatch(s) for s in stops]
        if len(start) != 1 or not all(matches):
            raise RsrlError(f"plan {text!r} does not parse; write it as S-H@14-S@36: start tyre, then each stop as tyre@lap")
        letters = [start, *(m.group(1) for m in matches if m)]
        for letter in letters:
            if letter not in COMPOUNDS:
                raise RsrlError(f"plan {text!r}: unknown compound {letter!r}; compounds are {', '.join(COMPOUNDS)}")
        return cls(tuple(COMPOUNDS.index(c) for c in letters), tuple(int(m.group(2)) for m in matches if m))

    @property
    def stops(self) -> int:
        """Number of stops."""
        return len(self.laps)

    def __str__(self) -> str:
        rest = "".join(f"-{COMPOUNDS[c]}@{lap}" for c, lap in zip(self.compounds[1:], self.laps, strict=True))
        return COMPOUNDS[self.compounds[0]] + rest


def check_plan(plan: Plan, record: RaceRecord) -> None:
    """Raise RsrlError where a plan breaks the rules of the race: order of stops, sets, two compounds, laps a set."""
    edges = (0, *plan.laps, record.laps)
    if any(b <= a for a, b in zip(edges, edges[1:], strict=False)):
        raise RsrlError(f"plan {plan}: stops must come in order, on laps 1 to {record.laps - 1} of {record.name}")
    if plan.stops > at.MAX_STOPS:
        raise RsrlError(f"plan {plan}: {plan.stops} stops; at most {at.MAX_STOPS}")
    if len(set(plan.compounds)) < 2:
        raise RsrlError(f"plan {plan}: a dry race needs two compounds; add a stop for another one")
    for code, sets in enumerate(record.sets):
        if plan.compounds.count(code) > sets:
            raise RsrlError(f"plan {plan}: needs {plan.compounds.count(code)} sets of {COMPOUNDS[code]}, a car has {sets} at {record.name}")
    limit = record.max_laps_per_set
    if limit and any(b - a > limit for a, b in zip(edges, edges[1:], strict=False)):
        raise RsrlError(f"plan {plan}: a set may run {limit} laps at most at {record.name}")


def plan_table(plans: Sequence[Plan]) -> NDArray[np.int32]:
    """Plans as rows of the compiled plan table, int32 [plans, P_COLUMNS]."""
    table = np.zeros((len(plans), at.P_COLUMNS), np.int32)
    for row, plan in zip(table, plans, strict=True):
        row[at.P_STOPS], row[at.P_START] = plan.stops, plan.compounds[0]
        row[at.P_FIRST : at.P_FIRST + 2 * plan.stops : 2] = plan.laps
        row[at.P_FIRST + 1 : at.P_FIRST + 2 * plan.stops : 2] = plan.compounds[1:]
        row[at.P_SC_WINDOW], row[at.P_VSC_WINDOW] = plan.sc_window_laps, plan.vsc_window_laps
    return table
