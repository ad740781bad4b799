"""Compile the race's kernels once, side by side, so that the test workers do not all compile the same ones: `python tests/warm_up.py`."""

from multiprocessing import get_context
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rsrl.season import RaceRecord


def compile_whole_races() -> None:
    """The kernel of `simulate`, which inlines the lap."""
    from rsrl.season import load_race
    from rsrl.simulator import simulate

    simulate(load_race("bahrain-2023"), 1, 0, threads=1)


def compile_laps() -> None:
    """The kernels that share one compiled lap: traces, averages, the environment, races that branch."""
    import numpy as np

    from rsrl.agents.networks import Duelling
    from rsrl.environment import RaceEnvironment
    from rsrl.rollouts import Branching, BranchingRaces, greedy_positions
    from rsrl.season import load_race
    from rsrl.simulator import lap_means

    record = load_race("bahrain-2023")
    lap_means(record, 1, 0, threads=1)
    environment = RaceEnvironment(record, 0, batch=1)
    environment.reset(0, np.zeros(1, np.int64))
    environment.step(np.zeros(1, np.int8))
    params = Duelling(environment.n_features, 4).init(np.random.default_rng(0))
    greedy_positions(record, 0, params, "full", 0, np.zeros(1, np.int64))
    settings = Branching(decisions=1, most=1.0, least=1.0, scale=1.0, all_calls=0.0, plan_share=0.0, pit_chance=0.0, delay_chance=0.0)
    BranchingRaces([(record, 0)]).branch(params, settings, 0, 0, 1)
    compile_explanations(record)


def compile_explanations(record: "RaceRecord") -> None:
    """The kernels of what-ifs and counterfactuals; they use those compiled above."""
    from rsrl.explanation import explain_counterfactual, load_explained, reach
    from rsrl.explanation.what_if import explain_what_if
    from rsrl.state import Observer
    from rsrl.translators import SimulatedRace

    race = SimulatedRace(record, 0, 0)
    state = race.state()
    assert state is not None, "nobody retires on the grid"
    Observer(record, 0).row(state)
    race.batch.advance()
    policy = load_explained("all")
    moment = reach(policy.strategist(record), record, 0, 2)
    explain_what_if(policy, moment, races=2, horizon_laps=0, status=1)
    explain_counterfactual(policy, moment, None, level="simulated")


def compile_lookahead() -> None:
    """The planner's rollouts, which inline the lap as well."""
    import numpy as np

    from rsrl.environment import RaceEnvironment
    from rsrl.season import load_race
    from rsrl.strategists import PlannerStrategist

    record, races = load_race("bahrain-2023"), np.zeros(1, np.int64)
    environment = RaceEnvironment(record, 0, batch=1)
    environment.reset(0, races)
    planner = PlannerStrategist(record, 0, 0, 2.0)
    planner.begin(environment, 0, races)
    for _ in range(record.laps):
        environment.step(planner.decide(environment))
    compile_search(record)


def compile_search(record: "RaceRecord") -> None:
    """Rollouts of the strategist `search`."""
    import numpy as np

    from rsrl.environment import RaceEnvironment
    from rsrl.strategists import PolicySearchStrategist, SearchSettings, make_strategist

    races = np.zeros(1, np.int64)
    environment = RaceEnvironment(record, 0, batch=1)
    environment.reset(0, races)
    search = make_strategist("search", record, 0)
    assert isinstance(search, PolicySearchStrategist)
    search.settings = SearchSettings(min_value=0.0, batch=1, max_futures=1)
    search.begin(environment, 0, races)
    environment.step(np.zeros(1, np.int8))  # to a lap on which there is a choice
    search.decide(environment)


def main() -> int:
    """Run them in processes of their own; returns the exit code."""
    workers = [get_context("spawn").Process(target=job) for job in (compile_whole_races, compile_laps, compile_lookahead)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return max(abs(worker.exitcode or 0) for worker in workers)


if __name__ == "__main__":
    raise SystemExit(main())
