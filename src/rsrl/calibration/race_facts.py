"""Grid, result and published strategies of a race: from the facts folder, or from the laps alone without one."""

import csv
import io
import re
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Final

import polars as pl

from rsrl.calibration.qualifying import qualifying_laps_s
from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS
from rsrl.text_files import read_text

_LIGHTLY_OUT: Final = re.compile(r"Finished|Lapped|\+\d+ Laps?")
_DISQUALIFIED: Final = "D"  # place of a disqualified car, whose status may give the reason instead
_NEVER_STARTED: Final = ("Withdrew", "Did not start", "Did not qualify", "Did not prequalify", "Excluded")
_LAST_CLASSIFIED_SHARE: Final = 0.9  # of the distance: sporting regulations


@dataclass(frozen=True)
class RaceFacts:
    """Grid, result and qualifying of one race."""

    grid: dict[str, int]  # driver to place, 1 is pole, no gaps, pit-lane starters last
    laps: int  # classified distance
    retired: frozenset[str]  # drivers who did not reach the flag
    source: str
    positions: dict[str, int]  # driver to finishing position, 1 .. starters, everyone who started
    classified: frozenset[str]  # drivers with a place in the official result: nine tenths of the distance, not disqualified
    laps_done: dict[str, int]  # laps completed by each starter
    teams: dict[str, str]  # by driver, as the lap file names them
    quali_s: dict[str, float]  # best qualifying lap, drivers without one left out; empty without a results folder
    disqualified: frozenset[str] = frozenset()  # drivers whose place was taken away; the result has them last, wherever they came in
    level_quali_s: dict[str, float] = field(default_factory=dict)  # the same with all sessions on one level


def race_facts(table: pl.DataFrame, facts_folder: Path | None, season: int, round_number: int) -> RaceFacts:
    """Grid, distance and retirements of a race: from the results table, or from its laps where no folder is given.

    Raises:
        RsrlError: the folder lacks a table or the race.
    """
    race = table.filter((pl.col("season") == season) & (pl.col("round") == round_number))
    if facts_folder is None:
        return _facts_from_laps(race)
    race_id = _one(facts_folder, "ergast_races.csv", {"year": str(season), "round": str(round_number)})["raceId"]
    codes = {r["driverId"]: r["code"] for r in table_rows(facts_folder, "ergast_drivers.csv")}
    statuses = {r["statusId"]: r["status"] for r in table_rows(facts_folder, "ergast_status.csv")}
    ran = dict(race.group_by("driver").len().iter_rows())
    entered = {codes[r["driverId"]]: r for r in table_rows(facts_folder, "ergast_results.csv") if r["raceId"] == race_id}
    rows = {code: r for code, r in entered.items() if _started(r, statuses[r["statusId"]], ran.get(code, 0))}
    if not rows:
        raise RsrlError(f"{facts_folder / 'ergast_results.csv'}: has no result of {season} round {round_number}; leave --facts out")
    unknown = sorted(set(ran) - set(entered))
    if unknown:
        names = ", ".join(unknown)
        raise RsrlError(f"{facts_folder / 'ergast_results.csv'}: {season} round {round_number} has no {names}; leave --facts out")
    laps = max(int(r["laps"]) for r in rows.values())
    disqualified = frozenset(code for code, r in rows.items() if r["positionText"] == _DISQUALIFIED)
    # the results may have no laps of a disqualified car, though it saw the flag
    done = {code: int(r["laps"]) for code, r in rows.items()}
    done |= {code: min(max(done[code], ran.get(code, 0)), laps) for code in disqualified}
    fell_out = {code for code, r in rows.items() if not _LIGHTLY_OUT.fullmatch(statuses[r["statusId"]])} - disqualified
    sessions = _qualifying(facts_folder, race_id, codes, set(rows))
    return RaceFacts(
        grid=_ranked({code: int(r["grid"]) or 99 for code, r in rows.items()}),
        laps=laps,
        retired=frozenset(fell_out | {code for code in disqualified if done[code] < _LAST_CLASSIFIED_SHARE * laps}),
        source="Ergast results",
        positions=_ranked({code: int(r["positionOrder"]) for code, r in rows.items()}),
        classified=frozenset(code for code, r in rows.items() if r["positionText"].isdigit()),
        laps_done=done,
        teams=_teams(race, {code: r["constructorId"] for code, r in rows.items()}, facts_folder),
        disqualified=disqualified,
        quali_s={driver: min(t for t in times if t is not None) for driver, times in sessions.items() if any(times)},
        level_quali_s=qualifying_laps_s(sessions),
    )


def _started(result: dict[str, str], status: str, laps: int) -> bool:
    """Whether a driver took the start. One who withdrew before it is no starter, though some lap files have a lap of his."""
    never = result["positionText"] == "W" or status in _NEVER_STARTED
    return laps > 1 or not never


def starters_only(race: pl.DataFrame, facts: RaceFacts) -> pl.DataFrame:
    """The laps of those who started."""
    return race.filter(pl.col("driver").is_in(list(facts.grid)))


def _teams(race: pl.DataFrame, constructors: dict[str, str], facts_folder: Path) -> dict[str, str]:
    """Team by driver as the lap file names it; of a driver without a lap by his team mate, else by the constructor's name."""
    teams = dict(race.select("driver", "team").unique().sort("driver").iter_rows())
    by_constructor = {constructors[d]: team for d, team in teams.items() if d in constructors}
    names = {r["constructorId"]: r["name"] for r in table_rows(facts_folder, "ergast_constructors.csv")}
    return {d: teams.get(d) or by_constructor.get(c) or names[c] for d, c in constructors.items()}


def _qualifying(facts_folder: Path, race_id: str, codes: dict[str, str], started: set[str]) -> dict[str, list[float | None]]:
    """Best times of each starter in the three sessions of qualifying, s."""
    return {
        codes[row["driverId"]]: [_clock_s(row[q]) if ":" in (row[q] or "") else None for q in ("q1", "q2", "q3")]
        for row in table_rows(facts_folder, "ergast_qualifying.csv")
        if row["raceId"] == race_id and codes[row["driverId"]] in started
    }


def _clock_s(text: str) -> float:
    """Seconds of a time such as `1:22.824`."""
    minutes, seconds = text.split(":")
    return 60.0 * int(minutes) + float(seconds)


def _facts_from_laps(race: pl.DataFrame) -> RaceFacts:
    """Order at the end of lap 1 for the grid, order on the road at the end for the result.

    A car that ran less than nine tenths of the distance retired.
    """
    laps = int(race["lap"].max())  # type: ignore[arg-type]
    first = race.filter(pl.col("lap") == 1).sort("position", "session_time_s", nulls_last=True)["driver"].to_list()
    rest = sorted(set(race["driver"]) - set(first))
    ends = race.sort("lap").group_by("driver").agg(pl.col("lap").max(), pl.col("session_time_s").last(), pl.col("team").last())
    order = ends.sort("lap", "session_time_s", descending=[True, False], nulls_last=True)
    done = dict(ends.select("driver", "lap").iter_rows())
    return RaceFacts(
        grid={driver: i + 1 for i, driver in enumerate([*first, *rest])},
        laps=laps,
        retired=frozenset(d for d, n in done.items() if n < _LAST_CLASSIFIED_SHARE * laps),
        source="positions at the end of lap 1 and of the race, no results table given",
        positions={driver: i + 1 for i, driver in enumerate(order["driver"])},
        classified=frozenset(d for d, n in done.items() if n >= _LAST_CLASSIFIED_SHARE * laps),
        laps_done=done,
        teams=dict(ends.select("driver", "team").sort("driver").iter_rows()),
        quali_s={},
    )


def _ranked(grid: dict[str, int]) -> dict[str, int]:
    return {driver: i + 1 for i, (driver, _) in enumerate(sorted(grid.items(), key=lambda item: (item[1], item[0])))}


def published_strategies(facts_folder: Path | None, season: int, round_number: int, race_laps: int) -> tuple[str, ...]:
    """Published strategies as plans such as `S-H@17-S@38`: stops in the middle of their window.

    Where no window was published, the stints share the distance left evenly, a soft one counting for 0.85 of the others.
    Strategies without a full order of compounds are left out.
    """
    if facts_folder is None or not (facts_folder / f"published_strategies_{season}.csv").is_file():
        return ()
    plans = []
    for row in table_rows(facts_folder, f"published_strategies_{season}.csv"):
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


def table_rows(folder: Path, name: str) -> list[dict[str, str]]:
    """Rows of a table of the facts folder; raises RsrlError where it cannot be read."""
    path = folder / name
    try:
        return _read_rows(path, path.stat().st_mtime_ns)
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror}); give the folder of the facts with --facts, or none") from None


@lru_cache(maxsize=32)
def _read_rows(path: Path, modified_ns: int) -> list[dict[str, str]]:
    """Rows of a table, cached until the file changes: every race of a season reads the same few tables."""
    return list(csv.DictReader(io.StringIO(read_text(path), newline="")))


def _one(folder: Path, name: str, wanted: dict[str, str]) -> dict[str, str]:
    for row in table_rows(folder, name):
        if all(row.get(k) == v for k, v in wanted.items()):
            return row
    raise RsrlError(f"{folder / name}: has no row with {wanted}; leave --facts out")
