"""Races followed once for all tests of the pit wall."""

from functools import cache
from typing import Final, NamedTuple

from rsrl.explanation import ExplainedPolicy, load_explained
from rsrl.wall.follow import BoardFollower, LookFollower
from rsrl.wall.race_log import RaceLog
from rsrl.wall.sources import SimulatedSource, Source
from rsrl.wall.tape import Tape

RACE: Final = "bahrain-2023"
SEED: Final = 1


class Followed(NamedTuple):
    """A source that has been followed to its end."""

    source: Source
    log: RaceLog


def follow(source: Source, drivers: tuple[str, ...]) -> Followed:
    """Follow a source to its end, with looks at some cars."""
    tape, log = Tape(), RaceLog("s1")
    tape.record(source)
    BoardFollower(source, tape, log, _nothing).run()
    for driver in drivers:
        LookFollower(source, tape, log, driver, _nothing).run()
    return Followed(source, log)


@cache
def policy() -> ExplainedPolicy:
    """The shipped policy."""
    return load_explained("all")


@cache
def simulated_source() -> SimulatedSource:
    """A simulated Bahrain, Hamilton's car driven by the policy."""
    return SimulatedSource(policy(), RACE, "HAM", SEED)


@cache
def simulated() -> Followed:
    """The same, followed."""
    return follow(simulated_source(), ("HAM", "VER", "ZHO"))


def _nothing() -> None:
    """Nobody watches."""
