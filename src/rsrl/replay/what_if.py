"""What would have happened: another call of a recorded race, and what the team did, rolled out in the same futures from what was known."""

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl import rollouts as out
from rsrl.errors import RsrlError
from rsrl.explanation.what_if import Comparison, Continuation, Option, compare, label
from rsrl.replay.caller import StateCaller
from rsrl.replay.follow import CarFollower
from rsrl.results import ReplayLap, ReplayWhatIf, WhatIfOption
from rsrl.season import COMPOUNDS
from rsrl.state import ACTION_NAMES
from rsrl.statistics import mean_estimate
from rsrl.translators import TrackedCar

STAY: Final = "stay"
_FORM: Final = re.compile(rf"(?:(?P<driver>[^@]+)@)?(?P<lap>\d+)-(?P<call>[SMHsmh]|{STAY})")


class AskedCall(NamedTuple):
    """Another call: at the end of a lap, 0 to stay out or 1 + compound; `driver` as typed, None for the car that is replayed."""

    driver: str | None
    lap: int
    call: int


def parse_asked_call(text: str) -> AskedCall:
    """A call such as `HAM@20-H`, `20-H` or `HAM@20-stay`; raises RsrlError for anything else."""
    found = _FORM.fullmatch(text.strip())
    if found is None:
        raise RsrlError(f"what-if {text!r} does not parse; write driver, lap and compound such as HAM@20-H, or HAM@20-stay")
    call = 0 if found["call"] == STAY else 1 + COMPOUNDS.index(found["call"].upper())
    return AskedCall(found["driver"], int(found["lap"]), call)


def what_if(
    follower: CarFollower, rows: Sequence[ReplayLap], car: TrackedCar, caller: StateCaller, asked: AskedCall, races: int, seed: int
) -> ReplayWhatIf:
    """Roll out another call beside the team's and the policy's own, in the same `races` futures.

    What the team did is its next stop, on the lap and for the tyre of the real race, the policy calling afterwards.

    Args:
        rows: the laps of the replay.
        car: as tracked to the end of the race.

    Raises:
        RsrlError: the lap was not driven or has no call, or the call is not possible on it.
    """
    row = next((row for row in rows if row.lap == asked.lap), None)
    lap = next((lap for lap in follower.laps if lap.lap == asked.lap), None)
    if row is None or lap is None:
        raise RsrlError(f"what-if: {follower.driver} has no lap {asked.lap}; it drove {len(rows)}")
    state = lap.final.tracked.state
    if state is None:
        raise RsrlError(f"what-if: lap {asked.lap} of {follower.driver} cannot be called: {lap.final.tracked.reason}")
    moment = caller.moment(state, follower.history(asked.lap))
    if not moment.legal[asked.call]:
        possible = ", ".join(name for name, legal in zip(ACTION_NAMES, moment.legal, strict=True) if legal)
        raise RsrlError(f"what-if: {ACTION_NAMES[asked.call]} is not possible on lap {asked.lap} of {follower.driver}; {possible} is")
    stops = tuple((stint.fitted_lap, stint.compound) for stint in car.stints if stint.fitted_lap >= asked.lap)
    named = {
        "team": _of_team(asked.lap, stops),
        "asked": Option(0, asked.call),
        "policy": Option(0, caller.policy.call(moment)),
    }
    results = Continuation(caller.policy, [moment]).run(list(named.values()), races, seed)
    compared = compare(results, 0)
    return ReplayWhatIf(
        lap=asked.lap,
        driver=follower.driver,
        races=races,
        options=tuple(
            _option(name, option, one, results[:, i], results[:, 0])
            for i, ((name, option), one) in enumerate(zip(named.items(), compared, strict=True))
        ),
        stops=tuple((lap, compound if compound in COMPOUNDS else None) for lap, compound in stops),
        finish=None if car.out or car.disqualified else car.position,
    )


def _of_team(lap: int, stops: Sequence[tuple[int, str | None]]) -> Option:
    """What the team did from a lap on: its next stop, or to stay out where it made none or the tyre is unknown."""
    if not stops or stops[0][1] not in COMPOUNDS:
        return Option(0, 0)
    at, compound = stops[0]
    return Option(at - lap, 1 + COMPOUNDS.index(str(compound)))


def _option(name: str, option: Option, one: Comparison, own: NDArray[np.float64], team: NDArray[np.float64]) -> WhatIfOption:
    both = (own[:, out.O_FINISHED] > 0) & (team[:, out.O_FINISHED] > 0)
    seconds = mean_estimate(own[both, out.O_TIME] - team[both, out.O_TIME])
    return WhatIfOption(
        name=name,
        call=label(option),
        mean_position=one.mean_position,
        positions=one.positions,
        places=one.places.mean,
        places_ci95=(one.places.low, one.places.high),
        seconds=seconds.value,
        seconds_ci95=seconds.ci95,
        chance_gain=one.chance_gain,
        chance_lose=one.chance_lose,
        finished=one.finished,
        verdict=one.verdict,
    )
