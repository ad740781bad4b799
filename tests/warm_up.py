"""Compile the race's kernels once, so that the test workers do not all compile the same ones: `python tests/warm_up.py`.

What many kernels call is compiled first, by one process; the kernels that call it follow side by side and find it in the cache.
"""

from collections.abc import Callable, Sequence
from multiprocessing import get_context


def compile_environment() -> None:
    """Start, lap and observation of a race, which nearly all other kernels call, and the environment's own kernels."""
    import numpy as np

    from rsrl.environment import RaceEnvironment
    from rsrl.season import load_race

    environment = RaceEnvironment(load_race("bahrain-2023"), 0, batch=1)
    environment.reset(0, np.zeros(1, np.int64))
    environment.step(np.zeros(1, np.int8))


def compile_whole_races() -> None:
    """Whole races on plans, and their averages by lap."""
    from rsrl.season import load_race
    from rsrl.simulator import lap_means, simulate

    record = load_race("bahrain-2023")
    simulate(record, 1, 0, threads=1)
    lap_means(record, 1, 0, threads=1)


def compile_policies() -> None:
    """A network inside the race: races that branch, and the rollouts of the strategist `search`."""
    import numpy as np

    from rsrl.agents.networks import Duelling
    from rsrl.environment import RaceEnvironment
    from rsrl.rollouts import Branching, BranchingRaces, greedy_positions
    from rsrl.season import load_race
    from rsrl.strategists import PolicySearchStrategist, SearchSettings, make_strategist

    record, races = load_race("bahrain-2023"), np.zeros(1, np.int64)
    environment = RaceEnvironment(record, 0, batch=1)
    params = Duelling(environment.n_features, 4).init(np.random.default_rng(0))
    greedy_positions(record, 0, params, "full", 0, races)
    settings = Branching(decisions=1, most=1.0, least=1.0, scale=1.0, all_calls=0.0, plan_share=0.0, pit_chance=0.0, delay_chance=0.0)
    BranchingRaces([(record, 0)]).branch(params, settings, 0, 0, 1)
    environment.reset(0, races)
    search = make_strategist("search", record, 0)
    assert isinstance(search, PolicySearchStrategist)
    search.settings = SearchSettings(min_value=0.0, batch=1, max_futures=1)
    search.begin(environment, 0, races)
    environment.step(np.zeros(1, np.int8))  # to a lap on which there is a choice
    search.decide(environment)


def compile_explanations() -> None:
    """What-ifs, counterfactuals, and observations of a state."""
    from rsrl.explanation import explain_counterfactual, load_explained, reach
    from rsrl.explanation.what_if import explain_what_if
    from rsrl.season import load_race
    from rsrl.state import Observer
    from rsrl.translators import SimulatedRace

    record = load_race("bahrain-2023")
    race = SimulatedRace(record, 0, 0)
    state = race.state()
    assert state is not None, "nobody retires on the grid"
    Observer(record, 0).row(state)
    race.batch.advance()
    policy = load_explained("all")
    moment = reach(policy.strategist(record), record, 0, 2)
    explain_what_if(policy, moment, races=2, horizon_laps=0, status=1)
    explain_counterfactual(policy, moment, None, level="simulated")


def compile_planner() -> None:
    """Rollouts of plans."""
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


def run_side_by_side(jobs: Sequence[Callable[[], None]]) -> int:
    """Run jobs in processes of their own; returns the largest exit code."""
    workers = [get_context("spawn").Process(target=job) for job in jobs]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return max(abs(worker.exitcode or 0) for worker in workers)


def main() -> int:
    """Returns the exit code."""
    return run_side_by_side([compile_environment]) or run_side_by_side(
        [compile_whole_races, compile_policies, compile_explanations, compile_planner]
    )


if __name__ == "__main__":
    raise SystemExit(main())
