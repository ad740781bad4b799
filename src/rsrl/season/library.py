"""Finding season files: those shipped in the package and those that a user made."""

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from rsrl.errors import RsrlError
from rsrl.season.drivers import codes_called
from rsrl.season.race_resolver import resolve_race
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


def load_race(name: str | Path, folder: Path | None = None) -> RaceRecord:
    """The record of a race by its name in any form that `resolve_race` reads, or of a season file given by its path.

    Args:
        name: `bahrain-2023`, `monza-2023`, `2023 British Grand Prix`, `bahrain` for the latest season; a path, or text that ends in .toml.
        folder: of the season files; the shipped ones by default.

    Raises:
        RsrlError: no such race, several that may be meant (the message names them), or a broken file.
    """
    if isinstance(name, Path) or name.endswith(".toml"):
        return read_race(Path(name))
    folder = folder or shipped_folder()
    known = sorted(path.stem for path in folder.glob("*.toml"))
    return read_race(folder / f"{resolve_race(name, known)}.toml")


def find_car(record: RaceRecord, driver: str | int | None) -> int:
    """Index of a driver's car, the race's default driver for None.

    Args:
        driver: code (`HAM`), car number (`44`) or surname (`Hamilton`); case and accents are optional.

    Raises:
        RsrlError: nobody of that name started, or several did; the message names who did.
    """
    if driver is None:
        return record.car_index(record.default_driver)
    codes = codes_called(str(driver), [car.driver for car in record.cars], record.season)
    if len(codes) == 1:
        return record.car_index(codes[0])
    if codes:
        raise RsrlError(f"driver {driver!r} may be {' or '.join(codes)} at {record.name}; name one by the code")
    started = ", ".join(sorted(car.driver for car in record.cars))
    raise RsrlError(f"unknown driver {driver!r} for {record.name}; who started: {started}")


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
