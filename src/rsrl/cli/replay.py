"""`rsrl replay`: a recorded race called lap by lap, with what was known at the time, beside what the team did."""

from pathlib import Path
from typing import Annotated

import typer

from rsrl.cli.options import JsonOption, SeedOption, WideOption
from rsrl.cli.output import Output
from rsrl.cli.progress import brief, progress
from rsrl.cli.provenance import provenance
from rsrl.cli.replay_options import DriverOption, ModelOption, SeasonFromOption

SourceArgument = Annotated[
    Path,
    typer.Argument(
        metavar="SOURCE",
        help="A recorded race: lap file, live timing (file or folder), game packets, OpenF1 (folder or openf1:KEY), log of rsrl live.",
    ),
]
RaceOption = Annotated[
    str | None,
    typer.Option("--race", metavar="RACE", help="The race, such as bahrain-2023, where the source has several or names none."),
]
SpeedOption = Annotated[
    str, typer.Option("--speed", metavar="X", help="The race's clock: 1 to 1000 times as fast as it was, or max for as fast as can be.")
]
AuditOption = Annotated[
    bool, typer.Option("--audit", help="Roll out every lap on which call and team differ, and say what each call was worth.")
]
WhatIfOption = Annotated[
    str | None,
    typer.Option("--what-if", metavar="CALL", help="What would have happened: HAM@20-H boxes for hard on lap 20; or HAM@20-stay."),
]
FuturesOption = Annotated[
    int, typer.Option("--races", metavar="N", min=2, max=100_000, help="Futures of each lap that is audited, and of --what-if.")
]


def command(
    source: SourceArgument,
    race: RaceOption = None,
    driver: DriverOption = None,
    model: ModelOption = None,
    season_from: SeasonFromOption = None,
    speed: SpeedOption = "max",
    audit: AuditOption = False,
    what_if: WhatIfOption = None,
    races: FuturesOption = 500,
    seed: SeedOption = 0,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Replay a recorded race: the policy's call on every lap, beside what the team did.

    A call is made of what a pit wall knew by then, and made again whenever
    the track status changes or a rival boxes; the last call before the car
    reaches the pit entry counts. The car itself drives the race that it
    drove: after the team's stop the calls go on from there.

    With --audit both calls are simulated from every lap on which they
    differ. With --what-if another call is simulated from what was known then,
    beside what the team did. Their verdicts are the simulator's.

    A race without season file (see rsrl races), a wet one, and laps on
    intermediates or wets are tracked without calls. --season-from takes the
    figures of another race, and finds a car of them for every driver.

    A feed that falls silent for eight seconds is stale, and not called until
    cars are heard of again. With --speed each look is told when it is due.

    [bold]Examples[/bold]

    rsrl replay laps_2023.csv.gz --race bahrain-2023 --driver HAM
    rsrl replay laps_2023.csv.gz --race monza-2023 --driver SAI --audit
    rsrl replay laps_2023.csv.gz --race bahrain-2023 --what-if HAM@20-H
    rsrl replay monza.jsonl --driver HAM --speed 100
    rsrl replay azerbaijan_2018 --driver HAM --season-from azerbaijan-2022
    """
    from msgspec.structs import replace

    from rsrl.cli.replay_tables import tables, told

    output = Output(json, wide)
    with brief(output, "Reading the race") as step:
        from rsrl.feeds.pacing import parse_speed
        from rsrl.replay import RecordedRace, parse_asked_call, replay_recorded

        step("following the race")
        asked = parse_asked_call(what_if) if what_if else None
        wanted = RecordedRace(source, race, driver, model, races if audit else 0, seed, season_from, parse_speed(speed), asked, races)
        tell = None if wanted.speed is None else lambda driver, lap, look: output.note(told(driver, lap, look))
        if not audit:
            result = replay_recorded(wanted, tell=tell)
    if audit:
        with progress(output, "Auditing the calls") as report:
            result = replay_recorded(wanted, report, tell)
    result = replace(result, provenance=provenance(seed if audit or what_if else None))
    output.result(result, *(tables(result) if not json else ()))
