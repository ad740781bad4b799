"""Every car of a race called in turn, by each strategist on the same races."""

from collections.abc import Sequence

from rsrl.report.differences import difference_cell, difference_plot
from rsrl.report.dots import Dot, DotRow
from rsrl.report.markup import Child, Markup, together
from rsrl.report.numbers import MISSING, race_title, signed, signed_range
from rsrl.report.scored import find
from rsrl.report.tables import Cell, table
from rsrl.results import Cars


def cars(rows: Sequence[Cars]) -> Markup:
    """Counts over cars, then for each race a dot plot a strategist and a table of all numbers."""
    races = dict.fromkeys(row.race for row in rows)
    return together(_counts(rows), [_race([row for row in rows if row.race == race]) for race in races])


def _counts(rows: Sequence[Cars]) -> Markup:
    against = rows[0].against
    cells: list[list[Child | Cell]] = [
        [
            f"{race_title(row.race)}: {row.strategist}",
            f"{row.ahead} of {row.cars}",
            str(row.surely_ahead),
            str(row.surely_behind),
            difference_cell(row.difference, row.ci95),
        ]
        for row in rows
    ]
    heads = ["race and strategist", f"{against} better", "surely ahead", "surely behind", f"places behind {against}, mean of cars"]
    note = (
        "Each car was called by each strategist on the same races. "
        f"Better: cars with which {against} has the better mean position. Surely: the interval of the difference excludes zero."
    )
    return table(f"Every car: {against} against others", heads, cells, note=note, class_="heated")


def _race(rows: Sequence[Cars]) -> Markup:
    return together([_plot(row) for row in rows if row.by_car], _table(rows))


def _plot(row: Cars) -> Markup:
    dots = [
        DotRow(
            f"P{car.grid} {car.driver}",
            [Dot(car.difference, car.ci95)],
            f"{signed(car.difference)} ({signed_range(car.ci95)})",
        )
        for car in sorted(row.by_car, key=lambda car: car.grid)
    ]
    caption = f"{race_title(row.race)}: {row.strategist}, places behind {row.against} with each car, by grid position"
    return difference_plot(dots, (), row.against, caption)


def _table(rows: Sequence[Cars]) -> Markup:
    """The numbers of the plots of a race, side by side."""
    every = sorted({(car.grid, car.driver) for row in rows for car in row.by_car})
    cells: list[list[Child | Cell]] = []
    for grid, driver in every:
        found = [find(row.by_car, driver=driver) for row in rows]
        cells.append([driver, f"P{grid}", *(difference_cell(car.difference, car.ci95) if car else MISSING for car in found)])
    caption = f"{race_title(rows[0].race)}: places behind {rows[0].against} by car"
    return table(caption, ["car", "grid", *(row.strategist for row in rows)], cells, class_="heated")
