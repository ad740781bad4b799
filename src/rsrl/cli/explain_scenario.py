"""What `rsrl explain` explains: a policy, a race and car, and a decision, from a simulated race or from a state file."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rsrl.cli.options import assumed
from rsrl.errors import RsrlError

if TYPE_CHECKING:
    from rsrl.explanation import AnyPolicy, ExplainedPolicy, Moment
    from rsrl.season import RaceRecord
    from rsrl.state import UnifiedRaceState


class Scenario(NamedTuple):
    """A policy, a race and car, and the decision to explain; `moment` is None where a whole race is explained."""

    policy: "AnyPolicy"
    record: "RaceRecord"
    car: int
    seed: int
    race: int
    moment: "Moment | None"
    from_file: bool

    @property
    def own(self) -> "ExplainedPolicy":
        """The policy of what needs its values. Raises RsrlError for a policy from elsewhere, which gives calls alone."""
        from rsrl.explanation import ExplainedPolicy

        if not isinstance(self.policy, ExplainedPolicy):
            raise RsrlError(f"{self.policy.name}: a policy from elsewhere gives calls without values, which are needed here")
        return self.policy


def find_scenario(
    model: str,
    race: str | None,
    driver: str | None,
    lap: int | None,
    state: Path | None,
    seed: int,
    race_number: int | None,
    changes: list[str] | None = None,
    sets: list[str] | None = None,
) -> Scenario:
    """The scenario that the options of the command name; without a race number, the first race of the seed that the car finishes.

    `changes` and `sets` are those of --set and --sets.

    Raises:
        RsrlError: there is no such model, race, driver or lap, the race is over before the lap, or the state file is not valid.
    """
    from rsrl.explanation import RaceOverError, first_finished_race, load_any_policy, reach
    from rsrl.explanation.state_file import read_state, state_source
    from rsrl.season import GROUPS, find_car, load_race

    policy = load_any_policy(model)
    found = read_state(state) if state is not None else None
    name = race or (found.race if found else policy.about.race)
    if not name or name in GROUPS or "," in name:
        raise RsrlError(f"{model} is a policy for {name or 'no race'}: name the race to explain with --race, such as bahrain-2023")
    record = assumed(load_race(name), changes, sets)
    if found is not None and state is not None:
        if race_number is not None:
            raise RsrlError(f"--race-number {race_number} names a simulated race, but --state gives the race as it stands; leave one out")
        return _from_state(policy, record, found, state_source(state), driver, lap, seed)
    car = find_car(record, driver)
    strategist = policy.strategist(record)
    number = first_finished_race(strategist, record, car, seed=seed) if race_number is None else race_number
    try:
        moment = None if lap is None else reach(strategist, record, car, lap, seed=seed, race=number)
    except RaceOverError as error:
        other = first_finished_race(strategist, record, car, seed=seed)
        raise RsrlError(f"{error}, such as --race-number {other}, which {record.cars[car].driver} finishes") from None
    return Scenario(policy, record, car, seed, number, moment, False)


def _from_state(
    policy: "AnyPolicy", record: "RaceRecord", state: "UnifiedRaceState", where: str, driver: str | None, lap: int | None, seed: int
) -> Scenario:
    from rsrl.explanation import moment_from_state
    from rsrl.explanation.state_file import check_race
    from rsrl.season import find_car

    car = check_race(state, record, where)
    if driver is not None and find_car(record, driver) != car:
        raise RsrlError(f"{where}: driver is {state.driver}, but --driver is {driver}; leave --driver out")
    if lap is not None and lap != state.laps_completed + 1:
        raise RsrlError(f"{where}: laps_completed is {state.laps_completed}, so the call is for lap {state.laps_completed + 1}, not {lap}")
    return Scenario(policy, record, car, seed, 0, moment_from_state(record, car, state, where=where), True)
