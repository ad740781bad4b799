"""`rsrl bench`: speed of simulator, environment, learner and decisions on this machine."""

import time
from collections.abc import Callable
from typing import Annotated

import typer

from rsrl.cli.options import JsonOption, SeedOption
from rsrl.cli.output import Output, table
from rsrl.cli.progress import steps
from rsrl.cli.provenance import provenance
from rsrl.results import Bench, DecisionSpeed, EnvironmentSpeed, SimulatorSpeed, TrainingSpeed
from rsrl.season import RaceRecord, load_race

RaceOption = Annotated[str, typer.Option("--race", metavar="RACE", help="The race to measure with.")]
RepeatsOption = Annotated[
    int, typer.Option("--repeats", metavar="N", min=1, help="Number of measurements of each figure; the best is reported.")
]
TrainOption = Annotated[float, typer.Option("--train-seconds", metavar="S", min=1.0, help="Training time, without compilation.")]


def command(
    race: RaceOption = "bahrain-2023",
    seed: SeedOption = 0,
    repeats: RepeatsOption = 5,
    train_seconds: TrainOption = 10.0,
    json: JsonOption = False,
) -> None:
    """Measure the speed of simulator, environment, training and decisions.

    Timings are noisy, so the best of several is reported, and versions should
    be compared side by side, as benchmarks/compare.py does. Training uses two
    cores where there are two, one to simulate and one to learn; measure a
    single core with taskset -c 0 rsrl bench.

    [bold]Examples[/bold]

    rsrl bench
    rsrl bench --repeats 10 --json
    """
    output = Output(json)
    record = load_race(race)
    with steps(output, "Measuring") as step:
        step("races")
        simulator = _simulator(record, seed, repeats)
        step("environment steps")
        environment = EnvironmentSpeed(_environment(record, seed, repeats))
        step("training")
        training = _training(record, seed, train_seconds)
        step("decisions")
        decision = DecisionSpeed(_decision(record, seed, repeats))
    content = Bench(record.name, simulator, environment, training, decision, provenance(seed))
    rows = [
        ("races a second, all cores", f"{simulator.races_per_s:,.0f}"),
        ("races a second, one core", f"{simulator.races_per_s_one_thread:,.0f}"),
        ("environment steps a second, one core", f"{environment.steps_per_s:,.0f}"),
        ("rollouts from decisions a second, in training", f"{training.branches_per_s:,.0f}"),
        ("one decision, ms", f"{decision.ms:.3f}"),
        ("peak memory of the simulator, MB", f"{simulator.peak_memory_mb:.0f}"),
    ]
    output.result(content, table(f"{record.name}, best of {repeats}", ("", ""), rows))


def _best(run: Callable[[], object], repeats: int) -> float:
    """Shortest of several run times in s, after one warm-up run."""
    run()
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        run()
        times.append(time.perf_counter() - begun)
    return min(times)


def _simulator(record: RaceRecord, seed: int, repeats: int) -> SimulatorSpeed:
    import resource

    from rsrl.simulator import available_cores, simulate

    races = 4000
    one = races / _best(lambda: simulate(record, races, seed, threads=1), repeats)
    many = 2 * races / _best(lambda: simulate(record, 2 * races, seed), repeats) if available_cores() > 1 else one
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return SimulatorSpeed(many, one, peak_mb)


def _environment(record: RaceRecord, seed: int, repeats: int) -> float:
    """Steps per second on one core: 256 races side by side, two planned stops each."""
    import numpy as np

    from rsrl.environment import RaceEnvironment

    environment = RaceEnvironment(record, record.car_index(record.default_driver), batch=256)
    races = np.arange(256, dtype=np.int64)
    plan = np.zeros((record.laps, 256), np.int8)
    plan[record.laps // 3] = plan[2 * record.laps // 3] = 3

    def run() -> None:
        environment.reset(seed, races)
        for actions in plan:
            environment.step(actions)

    return 256 * record.laps / _best(run, 4 * repeats)


def _training(record: RaceRecord, seed: int, seconds: float) -> TrainingSpeed:
    """Rollouts per second of RSRL's learner, after the first iterations, which compile, and the cores it used."""
    from rsrl.agents import Budget, Progress, default_config, train
    from rsrl.cli.entries import environment_factory, read_entries

    marks: list[Progress] = []
    make = environment_factory(read_entries(record.name, None))
    cpu = time.process_time()
    train(make, default_config("rsrl"), Budget(seconds=seconds), seed, progress=marks.append)
    cpu = time.process_time() - cpu
    first, last = marks[min(2, len(marks) - 2)], marks[-1]  # the clock starts after the first iteration, so there are at least two
    wall = max(last.seconds - first.seconds, 1e-9)
    return TrainingSpeed((last.steps - first.steps) / wall, cpu / max(last.seconds, 1e-9))


def _decision(record: RaceRecord, seed: int, repeats: int) -> float:
    """Time of one call of a policy for one race, from features to action, in ms: median of 200, best of the repeats."""
    import numpy as np

    from rsrl.agents import default_config, make_learner
    from rsrl.cli.entries import environment_factory, read_entries
    from rsrl.environment import RaceEnvironment

    config = default_config("rsrl")
    agent = make_learner(config, environment_factory(read_entries(record.name, None))(config), seed).agent()
    environment = RaceEnvironment(record, record.car_index(record.default_driver), feature_set=config.feature_set)
    seen = environment.reset(seed, np.zeros(1, np.int64))
    memory = agent.initial_memory(1)
    medians = []
    for _ in range(repeats):
        times = []
        for _ in range(200):
            begun = time.perf_counter()
            agent.act(seen.features, seen.legal, memory)
            times.append(time.perf_counter() - begun)
        medians.append(float(np.median(times)) * 1000)
    return min(medians)
