"""`rsrl demo`: trains a policy for a minute and compares it with the baselines."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rsrl.cli.files import refuse_overwrite, write_json
from rsrl.cli.leaderboard import DEFAULT_STRATEGISTS, CalledRaces, leaderboard_table, result_files, run_all, write_results
from rsrl.cli.options import CalledRacesOption, ForceOption, JsonOption, OutFolderOption, SeedOption
from rsrl.cli.output import Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.results import Evaluation, Training, plain
from rsrl.season import RaceRecord, load_race

if TYPE_CHECKING:
    from rich.table import Table

    from rsrl.agents import NetworkAgent
    from rsrl.evaluation import RaceLog

RACE = "bahrain-2023"
SHOWN_PER_STRATEGIST = 2
EXPLANATION_FILE = "explanation.json"
"""Written to --out beside the result, for `rsrl report`."""

EXPLAINED_LAP = 10
EXPLAINED_BY = ("what-if", "attribution")
"""Methods that are quick and need no fitted tree."""

SecondsOption = Annotated[float, typer.Option("--seconds", metavar="S", min=1.0, help="Training time.")]
PretrainedOption = Annotated[bool, typer.Option("--pretrained", help="Use the policy shipped with RSRL instead of training one.")]
TrainingSeedOption = Annotated[int, typer.Option("--train-seed", metavar="N", min=0, max=100_000, help="Seed of the training run.")]


def command(
    seconds: SecondsOption = 60.0,
    pretrained: PretrainedOption = False,
    races: CalledRacesOption = 1920,
    seed: SeedOption = 7,
    train_seed: TrainingSeedOption = 0,
    out: OutFolderOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Train a policy for the 2023 Bahrain Grand Prix and compare it.

    A policy for Lewis Hamilton's Mercedes is trained for about a minute in a
    simulator fitted to real lap times. It starts from the calls with the
    least expected race time, those of the baseline dp, and improves on them.
    Then the policy and the baselines call the same 1,920 races, with the same
    starting tyres, rivals, safety cars and random numbers. Neither training
    nor the plan searches have used any of these races. At the end the
    policy's call for lap 10 of one of them is explained.

    [bold]Examples[/bold]

    rsrl demo
    rsrl demo --pretrained --out demo
    rsrl demo --seconds 120 --json
    """
    from rsrl.cli.explain_tables import tables as explanation_tables
    from rsrl.evaluation import leaderboard
    from rsrl.strategists import PolicyStrategist

    output = Output(json)
    paths = result_files(out, force)
    if out:
        refuse_overwrite(out / EXPLANATION_FILE, force)
    record = load_race(RACE)
    car = record.car_index(record.default_driver)
    agent, steps = _shipped() if pretrained else _trained(record, car, seconds, train_seed, output)
    policy = PolicyStrategist(agent, record, agent.kind)
    logs = run_all(output, [policy], DEFAULT_STRATEGISTS.split(","), CalledRaces(record, car, seed, races))
    why = _explanation(agent, record, car, seed, output)
    result = Evaluation(
        race=record.name,
        driver=record.default_driver,
        races=races,
        seed=seed,
        training=Training(pretrained, None if pretrained else seconds, train_seed, steps),
        rows=tuple(leaderboard(logs[0], logs[1:])),
        provenance=provenance(seed),
        explanation=plain(why),
    )
    if paths:
        result = write_results(paths, result, logs, record)
    if out:
        write_json(out / EXPLANATION_FILE, why | {"provenance": result.provenance})
    board = leaderboard_table(record, result, policy.name)
    output.result(result, board, _strategy_table(record, logs), *explanation_tables(why))
    if not json:
        output.note(_closing(out))


def _explanation(agent: "NetworkAgent", record: RaceRecord, car: int, seed: int, output: Output) -> dict[str, Any]:
    """Explanation of the call for lap `EXPLAINED_LAP`, in the first race in which the car gets that far."""
    from rsrl.agents import ModelMetadata
    from rsrl.cli.explain_run import Request, run
    from rsrl.cli.explain_scenario import Scenario
    from rsrl.explanation import ExplainedPolicy, record_episode
    from rsrl.strategists.policy import weights_hash

    policy = ExplainedPolicy(agent, ModelMetadata(), agent.kind, Path(), weights_hash(agent))
    drives = (record_episode(policy, record, car, seed=seed, race=number) for number in range(100))
    moment = next(race for race in drives if race.laps >= EXPLAINED_LAP).moment(EXPLAINED_LAP)
    return run(Scenario(policy, record, car, seed, moment.race or 0, moment, False), Request(EXPLAINED_BY), output)


def _trained(record: RaceRecord, car: int, seconds: float, seed: int, output: Output) -> "tuple[NetworkAgent, int]":
    from rsrl.agents import Budget, default_config, train
    from rsrl.cli.entries import Entries, environment_factory
    from rsrl.cli.train import training_progress

    driver = record.cars[car].driver
    entries = Entries(record.name, (record,), (car,), driver)
    with progress(output, f"Training for {driver} at {record.event} {record.season}, {seconds:.0f} s") as report:
        result = train(
            environment_factory(entries), default_config("rsrl"), Budget(seconds=seconds), seed, progress=training_progress(report)
        )
    output.note(f"Learned from {result.steps:,} rollouts from decisions in {result.seconds:.0f} s")
    return result.agent, result.steps


def _shipped() -> "tuple[NetworkAgent, int]":
    from rsrl.agents import load_agent
    from rsrl.strategists import find_model

    agent, about = load_agent(find_model(RACE))
    return agent, about.steps


def _strategy_table(record: RaceRecord, logs: "list[RaceLog]") -> "Table":
    """The most common strategies of each strategist, with stints as bars, one character for two laps."""
    from rsrl.evaluation import common_strategies

    rows = []
    for log in logs:
        for strategy in common_strategies(log, SHOWN_PER_STRATEGIST):
            bar = _bar(strategy.compounds, strategy.laps, record.laps)
            windows = ", ".join(f"{low}-{high}" for low, high in strategy.windows)
            rows.append((log.strategist, bar, strategy.plan, windows, f"{100 * strategy.share:.0f}", f"{strategy.mean_position:.2f}"))
    columns = ("strategist", "stints", "strategy", "10-90 % of stops", "races %", "position")
    return table("Most common strategies", columns, rows, left=4)


def _bar(compounds: tuple[int, ...], laps: tuple[int, ...], total: int) -> str:
    """Stints as coloured blocks: soft red, medium yellow, hard white."""
    edges = [round(lap / 2) for lap in (0, *laps, total)]
    styles = ("red", "yellow", "white")
    letters = "SMH"
    parts = []
    for compound, begin, end in zip(compounds, edges, edges[1:], strict=False):
        text = letters[compound] + "█" * max(end - begin - 1, 0)
        parts.append(f"[{styles[compound]}]{text}[/{styles[compound]}]")
    return "".join(parts)


def _closing(out: Path | None) -> str:
    where = f"Result and figures are in {out}. " if out else ""
    return (
        where + "Next: `rsrl explain --race bahrain-2023 --lap 10`, `rsrl plan bahrain-2023`, `rsrl train --help`, `rsrl evaluate --help`."
    )
