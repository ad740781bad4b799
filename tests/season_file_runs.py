"""Invented races with their lap files and season files, for tests of the scripts that hold season files against real races."""

import dataclasses
from pathlib import Path

from invented_seasons import TEST, InventedRace, invented_races, write_files

from rsrl.season import write_race


def written(folder: Path) -> list[InventedRace]:
    """Write `laps/`, `facts/` and `files/` in a folder; returns the races of the test season, whose season files are the truth."""
    races = invented_races()
    write_files(races, folder)
    tested = [race for race in races if race.season == TEST]
    for race in tested:
        write_race(dataclasses.replace(race.record, round=race.round), folder / "files" / f"{race.record.name}.toml")
    return tested


def words(folder: Path, script: str, *more: str) -> list[str]:
    """The command of a script for these races, as in `sys.argv`; its result goes to `SCRIPT.json` in the folder."""
    places = [w for name in ("laps", "facts", "files") for w in (f"--{name}", str(folder / name))]
    return [f"{script}.py", str(TEST), *places, "--out", str(folder / f"{script}.json"), *more]
