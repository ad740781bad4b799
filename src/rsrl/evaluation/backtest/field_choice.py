"""What most of a field chose: the starting tyre, the sequence of compounds, its set of compounds, and the stops."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from rsrl.calibration.choices import CarChoice, RaceChoices

FEWEST_OWN: Final = 5
"""With fewer cars whose plan was their own a race says too little of what the field thought best: the others answered a safety car."""

QUARTERS: Final = (0.25, 0.5, 0.75)


@dataclass(frozen=True)
class FieldChoice:
    """The commonest choices of a race; of equally common ones, that of the car furthest forward on the grid.

    Attributes:
        start: compound that most cars started on, whatever became of them.
        starts: cars that started on it, and cars whose starting tyre is known.
        own: cars whose whole plan was their own (`CarChoice.own`), in order of the grid.
        sequence: that most of them ran; None where there are none.
        compounds: of most of them, order left out, sorted.
        stops: of most of them.
        finished: cars that finished, in order of the grid.
    """

    start: int
    starts: tuple[int, int]
    own: tuple[CarChoice, ...]
    sequence: tuple[int, ...] | None
    compounds: tuple[int, ...] | None
    stops: int | None
    finished: tuple[CarChoice, ...]

    @property
    def few(self) -> bool:
        """Whether too few cars ran a plan of their own."""
        return len(self.own) < FEWEST_OWN

    @property
    def on_sequence(self) -> tuple[CarChoice, ...]:
        """Cars of `own` that ran the commonest sequence."""
        return tuple(c for c in self.own if c.compounds == self.sequence)

    @property
    def first_stop(self) -> float:
        """Median lap of the first stop of those cars; NaN without one."""
        laps = [c.stops[0] for c in self.on_sequence]
        return float(np.median(laps)) if laps else float("nan")

    def three_cars(self) -> list[CarChoice]:
        """Cars at the quarters of the grid among those on the commonest sequence: a front, a middle and a rear one.

        Among all that finished where nobody ran a plan of his own; fewer than three where there are fewer.
        """
        cars = self.on_sequence or self.finished
        at = [round(q * (len(cars) - 1)) for q in QUARTERS] if cars else []
        return [cars[i] for i in dict.fromkeys(at)]


def field_choice(race: RaceChoices) -> FieldChoice:
    """The commonest choices of the field of a race."""
    own = tuple(c for c in race.cars if c.own)
    starts = [c.compounds[0] for c in race.cars if c.compounds and c.compounds[0] >= 0]
    start = most(starts)
    return FieldChoice(
        start=-1 if start is None else start,
        starts=(starts.count(start) if starts else 0, len(starts)),
        own=own,
        sequence=most(c.compounds for c in own),
        compounds=most(tuple(sorted(c.compounds)) for c in own),
        stops=most(len(c.stops) for c in own),
        finished=tuple(c for c in race.cars if c.finished),
    )


def most(values: Iterable[Any]) -> Any:
    """The commonest value, of equally common ones the first; None without one."""
    counted = Counter(values).most_common(1)
    return counted[0][0] if counted else None
