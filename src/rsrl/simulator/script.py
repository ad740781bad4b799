"""A script: a race replayed as it went, with every lap's track status, every retirement and every stop given."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field

from rsrl.errors import RsrlError
from rsrl.season import GREEN, RED, SC, VSC, RaceRecord
from rsrl.simulator import layout as at
from rsrl.simulator.plans import Plan


@dataclass(frozen=True)
class Script:
    """What happened in a race; cars by index of the record.

    The rules do not apply to a script, which is history: plans need not fit the sets, the two-compound rule or the limit on a set.
    A stop on a lap under RED is a change of tyres free of charge. Cars disqualified after the flag race as they did and are classified
    last, as in official results.
    """

    status: tuple[int, ...]  # track status of lap 1, 2 ... to the last
    retire: Mapping[int, int] = field(default_factory=dict)  # the lap on which the car does not reach the line
    plans: Mapping[int, Plan] = field(default_factory=dict)  # stops on the very laps; a car without one calls for itself
    disqualified: Set[int] = frozenset()


def check_script(script: Script, record: RaceRecord) -> None:
    """Raise RsrlError where a script does not fit the race."""
    name = f"script of {record.name}"
    if len(script.status) != record.laps:
        raise RsrlError(f"{name}: track status of {len(script.status)} laps; the race has {record.laps}")
    if bad := set(script.status) - {GREEN, VSC, SC, RED}:
        raise RsrlError(f"{name}: track status {min(bad)}; 0 green, 1 virtual safety car, 2 safety car, 3 red flag")
    if bad := {*script.retire, *script.plans, *script.disqualified} - set(range(len(record.cars))):
        raise RsrlError(f"{name}: car {min(bad)}; cars are 0 to {len(record.cars) - 1}")
    for car, lap in script.retire.items():
        if lap < 1:
            raise RsrlError(f"{name}: {record.cars[car].driver} retires on lap {lap}; the first is 1")
    for car, plan in script.plans.items():
        _check_stops(plan, f"{name}: {record.cars[car].driver}, plan {plan}", record.laps)


def _check_stops(plan: Plan, where: str, laps: int) -> None:
    if plan.stops > at.MAX_STOPS:
        raise RsrlError(f"{where}: {plan.stops} stops; at most {at.MAX_STOPS}")
    edges = (0, *plan.laps, laps)
    if any(b <= a for a, b in zip(edges, edges[1:], strict=False)):
        raise RsrlError(f"{where}: stops must come in order, on laps 1 to {laps - 1}")
