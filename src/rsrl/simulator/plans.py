"""Race plans: what to start on, when to stop and for what. `S-H@14-S@36` boxes at the end of laps 14 and 36."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, RaceRecord, c_numbers, read_compound, write_sets
from rsrl.simulator import layout as at

_STOP: Final = re.compile(r"([A-Z0-9]+)@(\d{1,3})")
_STINT: Final = re.compile(r"([A-Z0-9]+)(?:\((\d{1,3})\))?")
_FORMS: Final = (
    "write it as S-H@14-S@36 (start tyre, then each stop as tyre@lap) or S(14)-H(22)-S(21) (laps of each stint); "
    "a tyre is S, soft, or a C-number of the race"
)


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
    def parse(cls, text: str, record: RaceRecord | None = None) -> "Plan":
        """Read a plan: `S-H@14-S@36` by laps of stops, `S(14)-H(22)-S(21)` by lengths of stints; upper or lower case.

        A tyre is a letter, a colour (`soft`) or a C-number of the race. The last stint may go without its length.

        Args:
            text: the plan.
            record: the race it is for; needed for C-numbers and for the length of the last stint.

        Raises:
            RsrlError: it is not a plan, or stints do not add up to the laps of the race.
        """
        parts = [part.strip() for part in text.upper().split("-")]
        words, laps = _by_stints(text, parts, record) if "(" in text else _by_stops(text, parts)
        return cls(tuple(compound_code(word, record, f"plan {text!r}") for word in words), tuple(laps))

    @property
    def stops(self) -> int:
        """Number of stops."""
        return len(self.laps)

    def __str__(self) -> str:
        rest = "".join(f"-{COMPOUNDS[c]}@{lap}" for c, lap in zip(self.compounds[1:], self.laps, strict=True))
        return COMPOUNDS[self.compounds[0]] + rest


def compound_code(word: str, record: RaceRecord | None, where: str) -> int:
    """Code of a compound by letter, colour or C-number of the race; raises RsrlError that begins with `where`."""
    letter = read_compound(word, record.tyres if record else None)
    if letter is not None:
        return COMPOUNDS.index(letter)
    if re.fullmatch(r"C\d", word.upper()):
        known = f"at {record.name} {c_numbers(record.tyres)}" if record else "C-numbers need the race: Plan.parse(text, record)"
        raise RsrlError(f"{where}: unknown compound {word!r}; {known}")
    if len(word) > 1:
        raise RsrlError(f"{where} does not parse; {_FORMS}")
    raise RsrlError(f"{where}: unknown compound {word!r}; compounds are {', '.join(COMPOUNDS)}")


def _by_stops(text: str, parts: Sequence[str]) -> tuple[list[str], list[int]]:
    """Words of the compounds and laps of the stops of `S-H@14-S@36`."""
    start, *stops = parts
    matches = [found for part in stops if (found := _STOP.fullmatch(part))]
    if len(matches) < len(stops) or not re.fullmatch(r"[A-Z0-9]+", start):
        raise RsrlError(f"plan {text!r} does not parse; {_FORMS}")
    return [start, *(found[1] for found in matches)], [int(found[2]) for found in matches]


def _by_stints(text: str, parts: Sequence[str], record: RaceRecord | None) -> tuple[list[str], list[int]]:
    """Words of the compounds and laps of the stops of `S(14)-H(22)-S(21)`."""
    matches = [found for part in parts if (found := _STINT.fullmatch(part))]
    if len(matches) < len(parts) or not all(found[2] for found in matches[:-1]):
        raise RsrlError(f"plan {text!r} does not parse; {_FORMS}")
    words = [found[1] for found in matches]
    stops = list(accumulate(int(found[2]) for found in matches[:-1]))
    last = matches[-1][2]
    if last and record is None:
        raise RsrlError(f"plan {text!r}: the length of the last stint needs the race: Plan.parse(text, record); or leave it out")
    driven = (stops[-1] if stops else 0) + int(last or 0)
    if last and record and driven != record.laps:
        raise RsrlError(f"plan {text!r}: its stints are {driven} laps together, {record.name} has {record.laps}")
    return words, stops


def check_plan(plan: Plan, record: RaceRecord, car: int | None = None) -> None:
    """Raise RsrlError where a plan breaks the rules of the race: order of stops, sets, two compounds, sets to be used, laps a set.

    `car`: whose plan it is; None for a car that has no sets of its own.
    """
    edges = (0, *plan.laps, record.laps)
    if any(b <= a for a, b in zip(edges, edges[1:], strict=False)):
        raise RsrlError(f"plan {plan}: stops must come in order, on laps 1 to {record.laps - 1} of {record.name}")
    if plan.stops > at.MAX_STOPS:
        raise RsrlError(f"plan {plan}: {plan.stops} stops; at most {at.MAX_STOPS}")
    if len(set(plan.compounds)) < 2:
        raise RsrlError(f"plan {plan}: a dry race needs two compounds; add a stop for another one")
    if len(plan.compounds) < record.min_sets:
        raise RsrlError(f"plan {plan}: {record.name} asks for {record.min_sets} sets at least, that is {record.min_sets - 1} stops")
    _check_sets(plan, record, car)
    limit = record.max_laps_per_set
    if limit and any(b - a > limit for a, b in zip(edges, edges[1:], strict=False)):
        raise RsrlError(f"plan {plan}: a set may run {limit} laps at most at {record.name}")


def _check_sets(plan: Plan, record: RaceRecord, car: int | None) -> None:
    own = dict(zip(COMPOUNDS, record.sets_of(car), strict=True))
    lacking = {c: n for code, c in enumerate(COMPOUNDS) if (n := plan.compounds.count(code)) > len(own[c])}
    if not lacking:
        return
    letter, needed = next(iter(lacking.items()))
    driver = "a car" if car is None else record.cars[car].driver
    enough = write_sets({c: laps + (0,) * (lacking.get(c, 0) - len(laps)) for c, laps in own.items()})
    raise RsrlError(
        f"plan {plan}: needs {needed} sets of {letter}, {driver} has {len(own[letter])} at {record.name}; "
        f"if there were more, say --sets {'' if car is None else driver + '='}{enough}"
    )


def plan_table(plans: Sequence[Plan]) -> NDArray[np.int32]:
    """Plans as rows of the compiled plan table, int32 [plans, P_COLUMNS]."""
    table = np.zeros((len(plans), at.P_COLUMNS), np.int32)
    for row, plan in zip(table, plans, strict=True):
        row[at.P_STOPS], row[at.P_START] = plan.stops, plan.compounds[0]
        row[at.P_FIRST : at.P_FIRST + 2 * plan.stops : 2] = plan.laps
        row[at.P_FIRST + 1 : at.P_FIRST + 2 * plan.stops : 2] = plan.compounds[1:]
        row[at.P_SC_WINDOW], row[at.P_VSC_WINDOW] = plan.sc_window_laps, plan.vsc_window_laps
    return table
