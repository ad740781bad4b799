"""`rsrl simulate`: one race, many times."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from rsrl.cli.options import DriverOption, JsonOption, RaceArgument, SeedOption, SetOption, SetsOption, ThreadsOption, WideOption, assumed
from rsrl.cli.output import Column, FittedTable, Output, table
from rsrl.cli.progress import progress
from rsrl.cli.provenance import provenance
from rsrl.season import find_car, load_race

if TYPE_CHECKING:
    from rsrl.simulator import CarSummary

RacesOption = Annotated[int, typer.Option("--races", metavar="N", min=1, max=1_000_000, help="Number of races to simulate.")]
PlanOption = Annotated[
    str | None,
    typer.Option(
        "--plan",
        metavar="PLAN",
        help="Plan of the driver: S-H@14-S@36, S(14)-H(22)-S(21), SOFT-HARD@14 or C3-C1@14. Default: as rivals.",
    ),
]


def command(
    race: RaceArgument,
    races: RacesOption = 2000,
    seed: SeedOption = 0,
    driver: DriverOption = None,
    plan: PlanOption = None,
    changes: SetOption = None,
    sets: SetsOption = None,
    threads: ThreadsOption = None,
    wide: WideOption = False,
    json: JsonOption = False,
) -> None:
    """Simulate a race many times and show how each car fares.

    Safety cars, retirements, overtakes, slow stops and rivals' decisions are
    drawn at random in each race. The same seed gives the same random numbers
    whatever the plan, so two runs differ by the plan alone.

    The plan S-H@14-S@36 means: start on soft, box for hard at the end of
    lap 14 and for soft at the end of lap 36 (S soft, M medium, H hard).
    "S(14)-H(22)-S(21)", by the laps of each stint, is the same plan.

    [bold]Examples[/bold]

    rsrl simulate bahrain-2023
    rsrl simulate bahrain-2023 --races 20000 --seed 1 --json
    rsrl simulate bahrain-2023 --driver HAM --plan S-H@14-S@36
    rsrl simulate monza-2023 --driver leclerc --set pit_loss_s=+1
    """
    from rsrl.simulator import Plan, check_plan, simulate, summarise

    output = Output(json, wide)
    record = assumed(load_race(race), changes, sets)
    car = find_car(record, driver)
    plans = {}
    if plan is not None:
        plans[car] = Plan.parse(plan, record)
        check_plan(plans[car], record, car)
    simulate(record, 1, seed)  # loads or compiles the kernels, so that the reported speed is that of the races alone
    with progress(output, f"Simulating {races:,} races of {record.event} {record.season}") as report:
        results = simulate(record, races, seed, plans=plans, threads=threads, progress=report)
    cars = sorted(summarise(record, results), key=lambda summary: summary.mean_position)
    pace = races / results.seconds
    result = {
        "race": record.name,
        "races": races,
        "seed": seed,
        "seconds": results.seconds,
        "races_per_s": pace,
        "driver": record.cars[car].driver,
        "plan": str(plans[car]) if plans else None,
        "cars": [asdict(summary) for summary in cars],
        "provenance": provenance(seed),
    }
    title = f"{record.event} {record.season}: {races:,} races in {results.seconds:.2f} s ({pace:,.0f} a second), seed {seed}"
    marked = record.cars[car].driver if plans or driver else None
    output.result(result, cars_table(title, cars, marked))


def cars_table(title: str, cars: "list[CarSummary]", marked: str | None) -> FittedTable:
    """How each car fares, best mean position first; the car called `marked` is marked."""
    columns = (
        "driver", Column("team", 5, words=True), Column("grid", 1), "mean position", Column("win %", 2), Column("podium %", 4),
        Column("points %", 3), Column("out %", 6), Column("stops", 7),
    )  # fmt: skip
    rows = [
        (
            Text(f"{c.driver} <", "bold") if c.driver == marked else c.driver,
            c.team,
            c.grid,
            f"{c.mean_position:.2f}",
            *(f"{100 * share:.1f}" for share in (c.p_win, c.p_podium, c.p_points, c.p_retired)),
            f"{c.mean_stops:.2f}",
        )
        for c in cars
    ]
    return table(title, columns, rows, left=2)
