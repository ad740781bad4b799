"""Grid, result and published strategies of a race from the facts folder; what the laps alone tell where it is absent."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import polars as pl

from rsrl.errors import RsrlError
from rsrl.laps import RACE
from rsrl.season import COMPOUNDS, EVENT_SLUGS

_LIGHTLY_OUT: Final = re.compile(r"Finished|\+\d+ Laps?|Disqualified")


@dataclass(frozen=True)
class RaceFacts:
    """What is known of one race besides its laps."""

    grid: dict[str, int]  # driver to place, 1 is pole, no gaps, pit-lane starters last
    laps: int  # classified distance
    retired: frozenset[str]  # drivers who did not reach the flag
    source: str


def find_round(table: pl.DataFrame, name: str) -> tuple[int, int, str]:
    """Season, round and event of a race named like `bahrain-2023`; raises RsrlError listing what there is."""
    slug, _, year = name.rpartition("-")
    events = table.select(*RACE, "event").unique().sort(*RACE)
    named = [(f"{EVENT_SLUGS.get(e, '?')}-{s}", s, r, e) for s, r, e in events.iter_rows()]
    for key, s, r, e in named:
        if key == f"{slug}-{year}":
            return s, r, e
    known = ", ".join(sorted(k for k, *_ in named if k.endswith(year) or not year)) or "none of that season"
    raise RsrlError(f"race {name!r} is not in the lap files; there are {known}")


def race_facts(table: pl.DataFrame, facts_folder: Path | None, season: int, round_number: int) -> RaceFacts:
    """Grid, distance and retirements of a race: from the results table, or from its laps where no folder is given.

    Raises:
        RsrlError: the folder lacks a table or the race.
    """
    race = table.filter((pl.col("season") == season) & (pl.col("round") == round_number))
    if facts_folder is None:
        return _facts_from_laps(race)
    race_id = _one(facts_folder, "ergast_races.csv", {"year": str(season), "round": str(round_number)})["raceId"]
    drivers = {r["driverId"]: r for r in _rows(facts_folder, "ergast_drivers.csv")}
    statuses = {r["statusId"]: r["status"] for r in _rows(facts_folder, "ergast_status.csv")}
    results = [r for r in _rows(facts_folder, "ergast_results.csv") if r["raceId"] == race_id]
    if not results:
        raise RsrlError(f"{facts_folder / 'ergast_results.csv'}: has no result of {season} round {round_number}; leave --facts out")
    started = set(race["driver"])
    rows = [(drivers[r["driverId"]]["code"], r) for r in results]
    grid = _ranked({code: int(r["grid"]) or 99 for code, r in rows if code in started})
    last = max(grid.values(), default=0)
    for driver in sorted(started - set(grid)):
        last += 1
        grid[driver] = last
    retired = frozenset(code for code, r in rows if code in started and not _LIGHTLY_OUT.fullmatch(statuses[r["statusId"]]))
    return RaceFacts(grid, max(int(r["laps"]) for _, r in rows), retired, "Ergast results")


def _facts_from_laps(race: pl.DataFrame) -> RaceFacts:
    """Order at the end of lap 1 for the grid; a car whose last lap is two or more short of the leader's lap count less 10 % retired."""
    laps = int(race["lap"].max())  # type: ignore[arg-type]
    first = race.filter(pl.col("lap") == 1).sort("position", nulls_last=True)["driver"].to_list()
    rest = sorted(set(race["driver"]) - set(first))
    last = race.group_by("driver").agg(pl.col("lap").max())
    retired = frozenset(last.filter(pl.col("lap") < 0.9 * laps)["driver"].to_list())
    grid = {driver: i + 1 for i, driver in enumerate([*first, *rest])}
    return RaceFacts(grid, laps, retired, "positions at the end of lap 1, no results table given")


def _ranked(grid: dict[str, int]) -> dict[str, int]:
    return {driver: i + 1 for i, (driver, _) in enumerate(sorted(grid.items(), key=lambda item: (item[1], item[0])))}


def published_strategies(facts_folder: Path | None, season: int, round_number: int, race_laps: int) -> tuple[str, ...]:
    """Published strategies as plans such as `S-H@17-S@38`: stops in the middle of their window.

    Where a window was not published, stops stand at even shares of the distance left, a soft stint counting for 0.85 of the others.
    Strategies whose order of compounds was not given whole are left out.
    """
    if facts_folder is None or not (facts_folder / f"published_strategies_{season}.csv").is_file():
        return ()
    plans = []
    for row in _rows(facts_folder, f"published_strategies_{season}.csv"):
        letters = row["strategy"].split("-")
        if int(row["round"]) == round_number and len(letters) > 1 and set(letters) <= set(COMPOUNDS):
            plans.append(_plan_text(letters, _stop_laps(row, letters, race_laps)))
    return tuple(dict.fromkeys(plans))


def _stop_laps(row: dict[str, str], letters: list[str], race_laps: int) -> list[int]:
    known = {}
    for i in (1, 2):
        ends = [float(v) for v in (row[f"stop{i}_from"], row[f"stop{i}_to"]) if v]
        if ends:
            known[i] = sum(ends) / len(ends)
    said = re.search(r"first stint 'around (\d+) laps'", row["note"])
    if said and 1 not in known:
        known[1] = float(said.group(1))
    stints = [0.85 if letter == "S" else 1.0 for letter in letters]
    laps: list[int] = []
    for i in range(1, len(letters)):
        start = laps[-1] if laps else 0
        later = next((j for j in range(i + 1, len(letters)) if j in known), len(letters))
        end = known.get(later, float(race_laps))
        share = stints[i - 1] / sum(stints[i - 1 : later])
        laps.append(round(known.get(i, start + share * (end - start))))
    return laps


def _plan_text(letters: list[str], laps: list[int]) -> str:
    return letters[0] + "".join(f"-{c}@{lap}" for c, lap in zip(letters[1:], laps, strict=True))


def _rows(folder: Path, name: str) -> list[dict[str, str]]:
    try:
        with (folder / name).open(encoding="utf-8", newline="") as handle:
            return list(csv.DictReader(handle))
    except OSError as error:
        raise RsrlError(f"{folder / name}: cannot be read ({error.strerror}); give the folder of the facts with --facts, or none") from None


def _one(folder: Path, name: str, wanted: dict[str, str]) -> dict[str, str]:
    for row in _rows(folder, name):
        if all(row.get(k) == v for k, v in wanted.items()):
            return row
    raise RsrlError(f"{folder / name}: has no row with {wanted}; leave --facts out")
