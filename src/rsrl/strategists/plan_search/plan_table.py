"""A growing table of legal plans with their rows for the compiled race and their neighbours, cached because many races share them."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.season import RaceRecord
from rsrl.simulator import MAX_STOPS, Plan
from rsrl.simulator import layout as at
from rsrl.simulator.plans import plan_table
from rsrl.strategists.plan_search.neighbours import is_legal, neighbours

MOVES_LAPS: Final = (1, 2, 4)


class PlanTable:
    """Legal plans of one car in a race, numbered in the order they are added."""

    def __init__(self, record: RaceRecord, car: int) -> None:
        self._record, self._car = record, car
        self._plans: list[Plan] = []
        self._numbers: dict[Plan, int] = {}
        self._neighbours: dict[int, tuple[int, ...]] = {}
        self._table = np.zeros((1024, at.P_COLUMNS), np.int32)

    def __getitem__(self, number: int) -> Plan:
        return self._plans[number]

    def add(self, plans: Iterable[Plan]) -> list[int]:
        """Numbers of the legal ones among `plans`; new plans are added to the table."""
        return [number for plan in plans if (number := self._number(plan)) >= 0]

    def rows(self) -> NDArray[np.int32]:
        """Rows for the compiled race by plan number, int32 [plans, P_COLUMNS]."""
        return self._table[: len(self._plans)]

    def neighbours(self, number: int) -> tuple[int, ...]:
        """Numbers of the plans one move away: stops moved, a compound changed, one stop more or fewer."""
        if number not in self._neighbours:
            self._neighbours[number] = tuple(dict.fromkeys(self.add(self._moved(self._plans[number]))))
        return self._neighbours[number]

    def with_stop_on(self, number: int, laps: Iterable[int]) -> list[int]:
        """Numbers of the variants of a plan that stop on one of `laps`: an existing stop moved there, or an extra stop."""
        plan = self._plans[number]
        moved = []
        for lap in laps:
            moved += [replace(plan, laps=(*plan.laps[:i], lap, *plan.laps[i + 1 :])) for i in range(plan.stops)]
            moved += with_extra_stop(plan, lap)
        return self.add(moved)

    def _number(self, plan: Plan) -> int:
        """The plan's number, or -1 where it is illegal."""
        if plan not in self._numbers:
            self._numbers[plan] = len(self._plans) if is_legal(plan, self._record, self._car) else -1
            if self._numbers[plan] >= 0:
                self._enter(plan)
        return self._numbers[plan]

    def _enter(self, plan: Plan) -> None:
        if len(self._plans) == len(self._table):
            self._table = np.concatenate([self._table, np.zeros_like(self._table)])
        self._table[len(self._plans)] = plan_table([plan])[0]
        self._plans.append(plan)

    def _moved(self, plan: Plan) -> Iterator[Plan]:
        for move in MOVES_LAPS:
            yield from neighbours(plan, self._record, self._car, move, sc_rule=False)
        for stint in range(1, plan.stops + 1):
            for compound in range(3):
                yield replace(plan, compounds=(*plan.compounds[:stint], compound, *plan.compounds[stint + 1 :]))
            yield Plan((*plan.compounds[:stint], *plan.compounds[stint + 1 :]), (*plan.laps[: stint - 1], *plan.laps[stint:]))
        for begin, end in zip((0, *plan.laps), (*plan.laps, self._record.laps), strict=True):
            yield from with_extra_stop(plan, (begin + end) // 2)


def with_extra_stop(plan: Plan, lap: int) -> Iterator[Plan]:
    """The plan with one more stop at the end of `lap`, for each compound; nothing where it stops there already or has `MAX_STOPS` stops."""
    if lap in plan.laps or plan.stops == MAX_STOPS:
        return
    before = sum(own < lap for own in plan.laps)
    for compound in range(3):
        compounds = (*plan.compounds[: before + 1], compound, *plan.compounds[before + 1 :])
        yield Plan(compounds, (*plan.laps[:before], lap, *plan.laps[before:]))
