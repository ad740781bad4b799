"""Safety cars and red flags of earlier seasons, from the facts tables: they need no laps."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rsrl.calibration.entry import slug_of
from rsrl.calibration.facts import _rows as table_rows

MIN_LAPS: Final = 20  # Belgium 2021 was no race


@dataclass(frozen=True)
class Past:
    """One race of an earlier season by the facts tables alone."""

    season: int
    round: int
    grand_prix: str
    laps: int
    safety_cars: tuple[int, ...]  # laps of deployment
    red_flags: int


def read_history(facts_folder: Path, before: tuple[int, int]) -> tuple[Past, ...]:
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
            found.append(Past(season, number, slug_of(row["name"]), laps[row["raceId"]], cars.get(key, ()), len(reds.get(key, ()))))
    return tuple(sorted(found, key=lambda p: (p.season, p.round)))


def _by_race(rows: Iterable[dict[str, str]], column: str) -> dict[str, tuple[int, ...]]:
    """Laps of deployment by race; a race that began behind the safety car counts as lap 1."""
    found: dict[str, tuple[int, ...]] = {}
    for row in rows:
        text = row[column].strip()
        found[row["Race"]] = (*found.get(row["Race"], ()), max(int(float(text)), 1) if text.replace(".", "").isdigit() else 1)
    return found
