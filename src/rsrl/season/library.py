"""Finding season files: those shipped in the package and those that a user made."""

import tomllib
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from rsrl.errors import RsrlError
from rsrl.season.records import RaceRecord
from rsrl.season.toml_io import read_race


class RaceHead(NamedTuple):
    """The lines of a season file before any figure."""

    season: int
    round: int
    name: str
    event: str
    laps: int
    wet: bool
    default_driver: str


def shipped_folder() -> Path:
    """Folder of the season files in the package."""
    return Path(str(files("rsrl.season"))) / "races"


def race_heads(folder: Path | None = None) -> list[RaceHead]:
    """The races in a folder (the shipped one by default), in order of season and round; only the first lines of the files are read.

    Raises:
        RsrlError: a file has no such lines; the message names file and figure.
    """
    return sorted(_head(path) for path in (folder or shipped_folder()).glob("*.toml"))


def race_names(folder: Path | None = None) -> list[str]:
    """Names of the races in a folder (the shipped one by default), in order of season and round."""
    return [head.name for head in race_heads(folder)]


def load_race(name: str, folder: Path | None = None) -> RaceRecord:
    """The record of a race such as `bahrain-2023`, or of a season file given by its path.

    Raises:
        RsrlError: no such race (the message names those most like it) or a broken file.
    """
    if name.endswith(".toml"):
        return read_race(Path(name))
    folder = folder or shipped_folder()
    path = folder / f"{name}.toml"
    if "/" in name or "\\" in name or not path.is_file():
        known = sorted(p.stem for p in folder.glob("*.toml"))
        like = get_close_matches(name, known, n=4, cutoff=0.3) or known[:4]
        raise RsrlError(
            f"unknown race {name!r}; known races: {', '.join(like) or 'none'}{' ...' if len(known) > len(like) else ''} (see `rsrl races`)"
        )
    return read_race(path)


def find_car(record: RaceRecord, driver: str | None) -> int:
    """Index of a driver's car, the race's default driver for None; raises RsrlError naming who started."""
    code = record.default_driver if driver is None else driver.upper()
    try:
        return record.car_index(code)
    except KeyError:
        started = ", ".join(sorted(car.driver for car in record.cars))
        raise RsrlError(f"unknown driver {driver!r} for {record.name}; who started: {started}") from None


def _head(path: Path) -> RaceHead:
    """The lines before the first table. A file that lacks any of them is read as a whole, so that the error names what is wrong."""
    try:
        with path.open(encoding="utf-8") as handle:
            lines = []
            for line in handle:
                if line.startswith("["):
                    break
                lines.append(line)
        document = tomllib.loads("".join(lines))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        document = {}
    if all(isinstance(document.get(name), kind) for name, kind in RaceHead.__annotations__.items()):
        return RaceHead(*(document[name] for name in RaceHead._fields))
    record = read_race(path)
    return RaceHead(*(getattr(record, name) for name in RaceHead._fields))
