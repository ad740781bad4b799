"""What teams chose: the compounds and stop laps of every car of a race, and what a stop cost there."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import polars as pl

from rsrl.calibration.choices.sequences import SEQUENCE_INDEX
from rsrl.calibration.entry import RaceKey, completed, nominated
from rsrl.calibration.race_facts import race_facts
from rsrl.calibration.rules import rules_of
from rsrl.laps import BROKEN_RACES, CAR, RACE, WET, read_seasons, season_file, stints, tyre_stops, with_status
from rsrl.season import COMPOUNDS, GREEN, grand_prix_of

LAPS_DOWN: Final = 2
"""A car more laps behind the winner than this did not run the race it had planned."""

MIN_CARS: Final = 5
"""A race in which fewer cars finished on a known sequence tells too little of what the field thought."""

FIRST_SEASON: Final = 2019
"""First season in which compounds go by C-numbers."""

FEWEST_STOPS: Final = 3  # for a loss of time measured on the race's own stops


@dataclass(frozen=True)
class CarChoice:
    """The plan a car ran.

    Attributes:
        compounds: code of each stint; -1 where the record does not know it.
        stops: lap of each stop.
        green: whether each stop was made on a racing lap.
        last_lap: laps completed.
        finished: at most `LAPS_DOWN` laps behind the winner.
    """

    driver: str
    team: str
    grid: int
    compounds: tuple[int, ...]
    stops: tuple[int, ...]
    green: tuple[bool, ...]
    last_lap: int
    finished: bool

    @property
    def sequence(self) -> int:
        """Index in SEQUENCES, -1 for a plan that is not among them."""
        return SEQUENCE_INDEX.get(self.compounds, -1)

    @property
    def own(self) -> bool:
        """Whether the whole plan was the team's own choice: it finished, on a known sequence, all stops on racing laps."""
        return self.finished and self.sequence >= 0 and all(self.green)


@dataclass(frozen=True)
class RaceChoices:
    """The choices of one race.

    Attributes:
        key: the race; `laps` is the classified distance, `c_numbers` is empty where no source has them.
        cars: in order of the grid.
        clean: dry, without a red flag, and enough cars on known sequences: the races that teach and that are scored.
        wet, red: why it is not.
        pit_loss_s: median time lost by its stops on racing laps, None with fewer than `FEWEST_STOPS`.
        max_laps_per_set: limit by rule, 0 for none.
        min_stops: stops that the rules ask for.
    """

    key: RaceKey
    cars: tuple[CarChoice, ...]
    wet: bool
    red: bool
    pit_loss_s: float | None
    max_laps_per_set: int
    min_stops: int = 1

    @property
    def clean(self) -> bool:
        """Whether its choices can be learned from and scored."""
        return not self.wet and not self.red and sum(c.finished and c.sequence >= 0 for c in self.cars) >= MIN_CARS

    @property
    def teaches(self) -> bool:
        """Whether the tyres it was run on are known too."""
        return self.clean and bool(self.key.c_numbers)


def choices_in(laps_folder: Path, facts_folder: Path | None, last: int) -> tuple[RaceChoices, ...]:
    """The choices of every season in a folder of lap files from `FIRST_SEASON` to `last`; seasons without a file are left out.

    Raises:
        RsrlError: a file that cannot be read.
    """
    seasons = tuple(s for s in range(FIRST_SEASON, last + 1) if season_file(laps_folder, s).is_file())
    return read_choices(read_seasons(laps_folder, seasons), facts_folder) if seasons else ()


def read_choices(table: pl.DataFrame, facts_folder: Path | None) -> tuple[RaceChoices, ...]:
    """The choices of every race of a lap table, in order of season and round; races known to be broken are left out."""
    found = []
    for season, number in table.select(*RACE).unique().sort(*RACE).iter_rows():
        if (season, number) not in BROKEN_RACES:
            race = table.filter((pl.col("season") == season) & (pl.col("round") == number))
            found.append(race_choices(race, facts_folder))
    return tuple(found)


def race_choices(race: pl.DataFrame, facts_folder: Path | None) -> RaceChoices:
    """The choices of one race, from its own laps."""
    season, number, event = race.select(*RACE, "event").row(0)
    facts = race_facts(race, facts_folder, season, number)
    laps = with_status(race.filter(pl.col("lap") <= facts.laps))
    stops = tyre_stops(laps.select(race.columns))
    numbers = nominated(race, facts_folder)
    grand_prix = grand_prix_of(event)
    rules = rules_of(season, grand_prix)
    return RaceChoices(
        key=RaceKey(season, number, grand_prix, facts.laps, completed(numbers, season) if numbers else {}),
        cars=tuple(_cars(laps.select(race.columns), stops, facts.grid, facts.laps)),
        wet=bool(race["compound"].is_in(list(WET)).any()),
        red=bool(stops["red"].any()) or bool(race["track_status"].cast(pl.String).str.contains("5").any()),
        pit_loss_s=_pit_loss(laps, stops),
        max_laps_per_set=rules.max_laps_per_set,
        min_stops=rules.min_sets - 1,
    )


def _cars(laps: pl.DataFrame, stops: pl.DataFrame, grid: dict[str, int], race_laps: int) -> Iterator[CarChoice]:
    runs = stints(laps).sort("driver", "stint_number")
    made: dict[str, list[tuple[int, int]]] = {}
    for driver, lap, status in stops.select("driver", "lap", "status").sort("driver", "lap").iter_rows():
        made.setdefault(driver, []).append((lap, status))
    by_driver = {str(d): part for (d,), part in runs.group_by("driver", maintain_order=True)}
    for driver in sorted(by_driver, key=lambda d: grid.get(d, 99)):
        part = by_driver[driver]
        own = made.get(driver, [])
        last = int(part["last_lap"].max())  # type: ignore[arg-type]
        yield CarChoice(
            driver=driver,
            team=str(part["team"][0]),
            grid=grid.get(driver, len(grid)),
            compounds=tuple(COMPOUNDS.index(c) if c in COMPOUNDS else -1 for c in part["compound"]),
            stops=tuple(lap for lap, _ in own),
            green=tuple(status == GREEN for _, status in own),
            last_lap=last,
            finished=last >= race_laps - LAPS_DOWN,
        )


def _pit_loss(laps: pl.DataFrame, stops: pl.DataFrame) -> float | None:
    """Median over stops on racing laps of in-lap and out-lap against twice the driver's median racing lap, s."""
    usual = laps.filter(pl.col("status") == GREEN).group_by(*CAR).agg(usual_s=pl.col("lap_time_s").median())
    timed = laps.sort(*CAR, "lap").with_columns(
        after_s=pl.col("lap_time_s").shift(-1).over(*CAR), after=pl.col("status").shift(-1).over(*CAR)
    )
    lost = (
        stops.filter(pl.col("status") == GREEN)
        .join(timed.select(*CAR, "lap", "lap_time_s", "after_s", "after"), on=[*CAR, "lap"])
        .join(usual, on=list(CAR))
        .filter(pl.col("after") == GREEN)
        .select(lost=pl.col("lap_time_s") + pl.col("after_s") - 2 * pl.col("usual_s"))["lost"]
        .drop_nulls()
    )
    return float(lost.median()) if lost.len() >= FEWEST_STOPS else None  # type: ignore[arg-type]
