"""Safety cars and red flags of earlier seasons, from the facts tables, which need no laps."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rsrl.calibration.race_facts import table_rows
from rsrl.season import circuit_of, grand_prix_of
from rsrl.season.circuits import GRANDS_PRIX

MIN_LAPS: Final = 20  # Belgium 2021 was no race
NOMINAL_LAPS: Final = 58
EVERY_YEAR: Final = tuple(range(2010, 2018))
CALENDAR: Final[dict[str, tuple[int, ...]]] = {
    **dict.fromkeys(
        (
            "abu-dhabi",
            "australia",
            "belgium",
            "brazil",
            "canada",
            "china",
            "great-britain",
            "hungary",
            "italy",
            "japan",
            "monaco",
            "singapore",
            "spain",
        ),
        EVERY_YEAR,
    ),
    "austria": (2014, 2015, 2016, 2017),
    "azerbaijan": (2016, 2017),
    "bahrain": (2010, 2012, 2013, 2014, 2015, 2016, 2017),
    "germany": (2010, 2011, 2012, 2013, 2014, 2016),
    "malaysia": EVERY_YEAR,
    "mexico": (2015, 2016, 2017),
    "russia": (2014, 2015, 2016, 2017),
    "turkey": (2010, 2011),
    "united-states": (2012, 2013, 2014, 2015, 2016, 2017),
}
"""Grands Prix of 2010-2017. The results begin in 2018 and the table of safety cars lists only races with one, so it takes the calendar to
know the races without."""

OTHER_NAMES: Final = {(2016, "azerbaijan"): "European Grand Prix"}


@dataclass(frozen=True)
class EarlierRace:
    """Safety cars and red flags of one race of an earlier season."""

    season: int
    round: int
    circuit: str
    laps: int
    safety_cars: tuple[int, ...]  # laps of deployment
    red_flags: int


def read_history(facts_folder: Path, before: tuple[int, int]) -> tuple[EarlierRace, ...]:
    """Safety cars and red flags of every race in the results table strictly before (season, round)."""
    cars = _by_race(table_rows(facts_folder, "safety_cars.csv"), "Deployed")
    reds = _by_race(table_rows(facts_folder, "red_flags.csv"), "Lap")
    found = []
    laps: dict[str, int] = {}
    for row in table_rows(facts_folder, "ergast_results.csv"):
        laps[row["raceId"]] = max(laps.get(row["raceId"], 0), int(row["laps"]))
    for row in table_rows(facts_folder, "ergast_races.csv"):
        season, number = int(row["year"]), int(row["round"])
        if (season, number) < before and laps.get(row["raceId"], 0) >= MIN_LAPS:
            key = f"{season} {row['name']}"
            circuit = circuit_of(grand_prix_of(row["name"]), season)
            found.append(EarlierRace(season, number, circuit, laps[row["raceId"]], cars.get(key, ()), len(reds.get(key, ()))))
    return tuple(sorted([*found, *_before_results(cars, reds)], key=lambda p: (p.season, p.round, p.circuit)))


def _before_results(cars: dict[str, tuple[int, ...]], reds: dict[str, tuple[int, ...]]) -> Iterator[EarlierRace]:
    """Races of `CALENDAR`; their round is not known and set to 0."""
    for slug, years in CALENDAR.items():
        for year in years:
            key = f"{year} {OTHER_NAMES.get((year, slug), GRANDS_PRIX[slug].events[0])}"
            yield EarlierRace(year, 0, circuit_of(slug, year), NOMINAL_LAPS, cars.get(key, ()), len(reds.get(key, ())))


def _by_race(rows: Iterable[dict[str, str]], column: str) -> dict[str, tuple[int, ...]]:
    """Laps of deployment by race; a race that began behind the safety car counts as lap 1."""
    found: dict[str, tuple[int, ...]] = {}
    for row in rows:
        text = row[column].strip()
        found[row["Race"]] = (*found.get(row["Race"], ()), max(int(float(text)), 1) if text.replace(".", "").isdigit() else 1)
    return found
