"""`rsrl demo`: trains a policy, compares it with baselines and explains one of its calls, on two screens."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from rich.text import Text

from rsrl.cli.files import refuse_overwrite, write_json
from rsrl.cli.leaderboard import (
    DEFAULT_STRATEGISTS,
    CalledRaces,
    draw_strategies,
    leaderboard_table,
    result_files,
    run_all,
    write_results,
)
from rsrl.cli.options import CalledRacesOption, ForceOption, JsonOption, OutFolderOption, SeedOption, WideOption
from rsrl.cli.output import Column, FittedTable, Output, Shown, table
from rsrl.cli.progress import brief, progress
from rsrl.cli.provenance import provenance
from rsrl.results import Evaluation, Training, plain
from rsrl.season import RaceRecord, load_race

if TYPE_CHECKING:
    from rsrl.agents import NetworkAgent
    from rsrl.evaluation import RaceLog

RACE: Final = "bahrain-2023"
QUICK_STRATEGISTS: Final = "fixed,heuristic,dp"
"""Called by default: those that search no plans, which takes minutes with the compiling of the kernels for it."""

SHOWN_PER_STRATEGIST: Final = 2
EXPLANATION_FILE: Final = "explanation.json"
"""Written to --out beside the result, for `rsrl report`."""

EXPLAINED_LAP: Final = 10
QUICKLY_EXPLAINED_BY: Final = ("what-if",)
EXPLAINED_BY: Final = ("what-if", "attribution")
"""Methods that need no fitted tree."""

SecondsOption = Annotated[float, typer.Option("--seconds", metavar="S", min=1.0, help="Training time.")]
PretrainedOption = Annotated[bool, typer.Option("--pretrained", help="Use the policy shipped with RSRL instead of training one.")]
TrainingSeedOption = Annotated[int, typer.Option("--train-seed", metavar="N", min=0, max=100_000, help="Seed of the training run.")]
AllOption = Annotated[
    bool, typer.Option("--all", help="Search plans too, show the strategies driven, and explain the call in full; takes minutes more.")
]


def command(
    seconds: SecondsOption = 30.0,
    pretrained: PretrainedOption = False,
    races: CalledRacesOption = 1920,
    seed: SeedOption = 7,
    train_seed: TrainingSeedOption = 0,
    everything: AllOption = False,
    out: OutFolderOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Train a policy for the 2023 Bahrain Grand Prix and compare it.

    A policy for Lewis Hamilton's Mercedes is trained in a simulator fitted to
    real lap times. It starts from the calls with the least expected race
    time, those of the baseline dp, and improves on them. Then the policy and
    the baselines call the same 1,920 races, with the same starting tyres,
    rivals, safety cars and random numbers. Training has used none of these
    races. At the end the policy's call for lap 10 of one of them is explained
    by what each other call would lead to.

    By default only what two screens show is computed: the baselines fixed,
    heuristic and dp, one picture, one method of explanation. With --all also
    best-plan and best-plan-sc, which search plans, the strategies driven, and
    attribution. Without --out the picture goes to a temporary folder.

    [bold]Examples[/bold]

    rsrl demo
    rsrl demo --pretrained --out demo
    rsrl demo --all --seconds 120 --json
    """
    output = Output(json, wide)
    paths = result_files(out, force)
    if out:
        refuse_overwrite(out / EXPLANATION_FILE, force)
    record = load_race(RACE)
    car = record.car_index(record.default_driver)
    agent, steps = _shipped() if pretrained else _trained(record, car, seconds, train_seed, output)
    names = (DEFAULT_STRATEGISTS if everything else QUICK_STRATEGISTS).split(",")
    logs = _called(agent, names, CalledRaces(record, car, seed, races), output)
    why = _explanation(agent, record, car, seed, everything, output)
    result = _evaluation(logs, record, races, seed, Training(pretrained, None if pretrained else seconds, train_seed, steps), why)
    if paths:
        result = write_results(paths, result, logs, record)
    if out:
        write_json(out / EXPLANATION_FILE, why | {"provenance": result.provenance})
    if json:
        output.result(result)
        return
    picture = paths["strategies.png"] if paths else _picture(logs, record, output)
    output.result(result, *_shown(record, result, agent.kind, logs, why, everything), *_closing(picture))


def _called(agent: "NetworkAgent", names: list[str], called: CalledRaces, output: Output) -> "list[RaceLog]":
    from rsrl.strategists import PolicyStrategist

    return run_all(output, [PolicyStrategist(agent, called.record, agent.kind)], names, called)


def _evaluation(logs: "list[RaceLog]", record: RaceRecord, races: int, seed: int, training: Training, why: dict[str, Any]) -> Evaluation:
    from rsrl.evaluation import leaderboard

    return Evaluation(
        race=record.name,
        driver=record.default_driver,
        races=races,
        seed=seed,
        training=training,
        rows=tuple(leaderboard(logs[0], logs[1:])),
        provenance=provenance(seed),
        explanation=plain(why),
    )


def _shown(record: RaceRecord, result: Evaluation, model: str, logs: "list[RaceLog]", why: dict[str, Any], everything: bool) -> list[Shown]:
    from rsrl.cli.explain_tables import in_brief
    from rsrl.cli.explain_tables import tables as explanation_tables

    board = leaderboard_table(record, result, model)
    return [board, _strategy_table(record, logs), *explanation_tables(why)] if everything else [board, *in_brief(why)]


def _explanation(agent: "NetworkAgent", record: RaceRecord, car: int, seed: int, everything: bool, output: Output) -> dict[str, Any]:
    """Explanation of the call for lap `EXPLAINED_LAP`, in the first race that the car finishes."""
    from rsrl.agents import ModelMetadata
    from rsrl.cli.explain_run import Request, run
    from rsrl.cli.explain_scenario import Scenario
    from rsrl.explanation import ExplainedPolicy, first_finished_race, reach
    from rsrl.strategists.policy import weights_hash

    policy = ExplainedPolicy(agent, ModelMetadata(), agent.kind, Path(), weights_hash(agent))
    strategist = policy.strategist(record)
    race = first_finished_race(strategist, record, car, seed=seed)
    moment = reach(strategist, record, car, EXPLAINED_LAP, seed=seed, race=race)
    request = Request(EXPLAINED_BY if everything else QUICKLY_EXPLAINED_BY, asides=everything)
    return run(Scenario(policy, record, car, seed, race, moment, False), request, output)


def _picture(logs: "list[RaceLog]", record: RaceRecord, output: Output) -> Path:
    """The strategies driven, drawn to a folder for temporary files."""
    import tempfile

    from rsrl.evaluation import common_strategies

    path = Path(tempfile.mkdtemp(prefix="rsrl-demo-")) / "strategies.png"
    with brief(output, "Drawing the strategies"):
        draw_strategies([one for log in logs for one in common_strategies(log)], record, record.default_driver, path)
    return path


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


def _strategy_table(record: RaceRecord, logs: "list[RaceLog]") -> FittedTable:
    """The most common strategies of each strategist, with stints as bars, one character for two laps."""
    from rsrl.evaluation import common_strategies

    rows = []
    for log in logs:
        for strategy in common_strategies(log, SHOWN_PER_STRATEGIST):
            bar = _bar(strategy.compounds, strategy.laps, record.laps)
            windows = ", ".join(f"{low}-{high}" for low, high in strategy.windows)
            rows.append((log.strategist, bar, strategy.plan, windows, f"{100 * strategy.share:.0f}", f"{strategy.mean_position:.2f}"))
    columns = ("strategist", "stints", "strategy", Column("10-90 % of stops", 1), Column("races %", 2), "position")
    return table("Most common strategies", columns, rows, left=4)


def _bar(compounds: tuple[int, ...], laps: tuple[int, ...], total: int) -> Text:
    """Stints as coloured blocks: soft red, medium yellow, hard white."""
    edges = [round(lap / 2) for lap in (0, *laps, total)]
    styles = ("red", "yellow", "white")
    letters = "SMH"
    parts = []
    for compound, begin, end in zip(compounds, edges, edges[1:], strict=False):
        text = letters[compound] + "█" * max(end - begin - 1, 0)
        parts.append((text, styles[compound]))
    return Text.assemble(*parts)


def _closing(picture: Path) -> list[Shown]:
    return [
        Text(f"Strategies driven, as a picture: {picture}", no_wrap=True),
        "Next: rsrl plan bahrain-2023                     the best plans before the race",
        "      rsrl explain --race bahrain-2023 --lap 20  why a policy makes a call",
        "      rsrl demo --all                            with plan searches and more",
        "      rsrl wall --race bahrain-2023              the race and its calls, in the browser",
    ]
