"""The season files: those shipped in the package and those a user made."""

from importlib.resources import files
from pathlib import Path

from rsrl.errors import RsrlError
from rsrl.season.records import RaceRecord
from rsrl.season.toml_io import read_race


def shipped_folder() -> Path:
    """Folder of the season files in the package."""
    return Path(str(files("rsrl.season"))) / "races"


def race_names(folder: Path | None = None) -> list[str]:
    """Names of the races in a folder (the shipped one by default), in order of season and round."""
    records = [read_race(p) for p in sorted((folder or shipped_folder()).glob("*.toml"))]
    return [r.name for r in sorted(records, key=lambda r: (r.season, r.round))]


def load_race(name: str, folder: Path | None = None) -> RaceRecord:
    """The record of a race such as `bahrain-2023`, or of a season file given by its path.

    Raises:
        RsrlError: no such race (the message lists those there are) or a broken file.
    """
    if name.endswith(".toml"):
        return read_race(Path(name))
    folder = folder or shipped_folder()
    path = folder / f"{name}.toml"
    if "/" in name or "\\" in name or not path.is_file():
        known = ", ".join(sorted(p.stem for p in folder.glob("*.toml"))) or "none"
        raise RsrlError(f"unknown race {name!r}; known races: {known} (see `rsrl races`)")
    return read_race(path)


def find_car(record: RaceRecord, driver: str | None) -> int:
    """Index of a driver's car, the race's default driver for None; raises RsrlError naming who started."""
    code = record.default_driver if driver is None else driver.upper()
    try:
        return record.car_index(code)
    except KeyError:
        started = ", ".join(sorted(car.driver for car in record.cars))
        raise RsrlError(f"unknown driver {driver!r} for {record.name}; who started: {started}") from None
