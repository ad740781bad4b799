"""`rsrl explain`: why a policy makes its call on one lap of a race, as text, JSON or a page."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rsrl.cli.explain_options import (
    BACKGROUNDS,
    CHECKS,
    LEVELS,
    METHODS,
    NORMS,
    TARGETS,
    check_options,
    parse_methods,
)  # fmt: skip
from rsrl.cli.files import check_file, write_text
from rsrl.cli.options import AnyPolicyArgument, DriverOption, ForceOption, JsonOption, SeedOption, SetOption, SetsOption, WideOption
from rsrl.cli.output import Output
from rsrl.cli.progress import brief
from rsrl.cli.provenance import command_line, provenance

RaceOption = Annotated[str | None, typer.Option("--race", metavar="RACE", help="The race; by default that of the model or state file.")]
LapOption = Annotated[int | None, typer.Option("--lap", metavar="N", help="The lap whose call is explained, 1 for the first.")]
RaceNumberOption = Annotated[
    int | None,
    typer.Option(
        "--race-number", metavar="N", min=0, help="Number of the simulated race within the seed. Default: the first that the car finishes."
    ),
]
StateOption = Annotated[
    Path | None,
    typer.Option(
        "--state", metavar="FILE", help="A race state as JSON instead of a simulated race, such as `state` of --json; - for standard input."
    ),
]
MethodOption = Annotated[str, typer.Option("--method", metavar="A,B", help=f"{', '.join(METHODS)}; several separated by commas, or all.")]
LevelOption = Annotated[str, typer.Option("--level", metavar="LEVEL", help=f"Level of the attribution: {', '.join(LEVELS)}.")]
BackgroundOption = Annotated[
    str, typer.Option("--background", metavar="NAME|FILE", help=f"Baseline of the attribution: {', '.join(BACKGROUNDS)}, or a JSON file.")
]
TargetOption = Annotated[
    str | None,
    typer.Option("--target", metavar="CALL", help=f"Call that the counterfactual leads to: {', '.join(TARGETS)}; default: the next best."),
]
NormOption = Annotated[str, typer.Option("--norm", metavar="NORM", help=f"Distance norm of the counterfactual: {', '.join(NORMS)}.")]
CheckOption = Annotated[str, typer.Option("--check", metavar="LEVEL", help=f"How the counterfactual is verified: {', '.join(CHECKS)}.")]
FuturesOption = Annotated[
    int, typer.Option("--races", metavar="N", min=2, max=1_000_000, help="Futures simulated for each what-if option.")
]
TableOption = Annotated[
    bool,
    typer.Option("--safety-car-table", help="The calls if a safety car or a virtual one comes out, lap by lap, to prepare a race."),
]
FitOption = Annotated[bool, typer.Option("--fit-tree", help="Fit the policy's tree for this race again and store it.")]
TreeOption = Annotated[
    Path | None, typer.Option("--tree", metavar="FILE", help="Tree file to use; by default the one stored with the model.")
]
TreePageOption = Annotated[
    Path | None, typer.Option("--tree-page", metavar="FILE", help="Write the tree as a page, the path of this call open.")
]
HtmlOption = Annotated[Path | None, typer.Option("--html", metavar="FILE", help="Write an HTML page to read and print; with --json, both.")]


def command(
    model: AnyPolicyArgument = "all",
    race: RaceOption = None,
    lap: LapOption = None,
    seed: SeedOption = 0,
    race_number: RaceNumberOption = None,
    driver: DriverOption = None,
    state: StateOption = None,
    changes: SetOption = None,
    sets: SetsOption = None,
    method: MethodOption = "all",
    level: LevelOption = LEVELS[0],
    background: BackgroundOption = BACKGROUNDS[0],
    target: TargetOption = None,
    norm: NormOption = NORMS[0],
    check: CheckOption = CHECKS[0],
    races: FuturesOption = 2000,
    safety_car_table: TableOption = False,
    fit_tree: FitOption = False,
    tree: TreeOption = None,
    tree_page: TreePageOption = None,
    html: HtmlOption = None,
    force: ForceOption = False,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Explain a call: what each option is worth, which inputs decide it, what would change it.

    The race is simulated and called by the policy up to the lap, or read
    from a state file. What-if simulates every option in the same futures and
    says which are equally good. Attribution divides the preference for the
    call among the inputs of the policy. The tree states the call as a few
    conditions. The counterfactual is the smallest change of the race after
    which the policy makes another call, confirmed by asking the policy. The
    summary covers the whole race.

    [bold]Examples[/bold]

    rsrl explain --race bahrain-2023 --lap 10
    rsrl explain bahrain-2023 --lap 10 --method what-if,counterfactual --target soft
    rsrl explain --race spain-2023 --lap 20 --seed 3 --html lap20.html
    rsrl explain --race bahrain-2023 --safety-car-table --json
    rsrl explain my_policy:call --race bahrain-2023 --lap 10
    """
    from rsrl.cli.explain_run import Request, run
    from rsrl.cli.explain_scenario import find_scenario
    from rsrl.cli.explain_tables import tables

    output = Output(json, wide)
    whole_race = safety_car_table or fit_tree or tree_page is not None
    methods = parse_methods(method, lap is not None or state is not None, whole_race)
    check_options(level, background, target, norm, check)
    _check_files({"--html": html, "--tree-page": tree_page}, force)
    with brief(output, "Simulating the race up to the lap"):
        scenario = find_scenario(model, race, driver, lap, state, seed, race_number, changes, sets)
    request = Request(methods, level, background, target, norm, check, races, safety_car_table, fit_tree, tree, tree_page, "all" in method)
    document = run(scenario, request, output) | {"provenance": provenance(seed)}
    if html is not None:
        _write_page(html, document, output)
    output.result(document, *(tables(document) if not json else ()))


def _check_files(paths: dict[str, Path | None], force: bool) -> None:
    for option, path in paths.items():
        if path is not None:
            check_file(path, force, option)


def _write_page(path: Path, document: dict[str, Any], output: Output) -> None:
    from rsrl.report import explanation_page

    write_text(path, explanation_page(document, command_line(), document["provenance"].date), "--html")
    output.note(f"Wrote {path}")
