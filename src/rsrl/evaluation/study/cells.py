"""One cell of a study: a strategist calls some races of one Grand Prix for one car."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Final

from threadpoolctl import threadpool_limits

from rsrl import __version__
from rsrl.agents import load_agent
from rsrl.agents.checkpoint import METADATA_FILE, MODEL_FILE
from rsrl.errors import RsrlError
from rsrl.evaluation.paired import RaceLog, run_races
from rsrl.evaluation.strategies import common_strategies
from rsrl.results import CommonStrategy, plain
from rsrl.season import RaceRecord, find_car, load_race, race_hash, shipped_folder
from rsrl.simulator import Plan
from rsrl.strategists import STRATEGISTS, PolicyStrategist, Strategist, find_model, make_strategist

MODEL_FILES: Final = (METADATA_FILE, MODEL_FILE)
OPTIONS: Final = {"rivals": ("reactive", "plans")}
"""What a cell may vary, and the values it may take."""

CODE: Final = (
    "season", "simulator", "state", "environment", "rollouts", "strategists", "compiled.py",
    "agents/interface.py", "agents/networks.py", "agents/checkpoint.py",
    "evaluation/paired.py", "evaluation/strategies.py", "evaluation/study/cells.py",
)  # fmt: skip
"""Sources under src/rsrl that decide how a race comes out, packages with all their sub-packages. How a model was trained is in its hash."""


@dataclass(frozen=True)
class Cell:
    """One run of a study. Made by `make_cell`, which fills in the hashes.

    Attributes:
        strategist: a name of `STRATEGISTS`, or where a model lies: a run folder, or the name of a shipped policy.
        race: name of a race such as `japan-2023`, or the path of a season file.
        driver: whose race is called.
        seed, first_race, races: races number first_race, first_race + 1 ... of the seed.
        options: see `OPTIONS`; empty for the races as they are.
        model_hash: of the model's files; "" for a strategist that needs no model.
        race_hash: of the race's figures.
        code_hash: of the sources that decide how a race comes out.
    """

    strategist: str
    race: str
    driver: str
    seed: int
    races: int
    first_race: int
    options: tuple[tuple[str, str], ...]
    model_hash: str
    race_hash: str
    code_hash: str

    @property
    def key(self) -> str:
        """Name of the cell's result: a readable part, then a hash of all it depends on; of a model that is its content, not its path."""
        told = asdict(self) | {"version": __version__}
        if self.model_hash:
            told["strategist"] = ""
        digest = hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:20]
        who = f"model_{self.model_hash[:8]}" if self.model_hash else self.strategist
        return f"{Path(self.race).stem}_{self.driver}_{who}_{digest}"

    @property
    def text(self) -> str:
        """The cell as a message names it."""
        return f"{self.strategist} on {self.race}, {self.driver}"


def make_cell(
    strategist: str,
    race: str,
    driver: str | None,
    *,
    seed: int,
    races: int,
    first_race: int = 0,
    options: Mapping[str, str] | None = None,
) -> Cell:
    """A cell of a strategist or model, a race and a driver, the race's default driver for None.

    Raises:
        RsrlError: no such strategist or model, race, driver or option.
    """
    options = dict(options or {})
    for name, value in options.items():
        if value not in OPTIONS.get(name, ()):
            raise RsrlError(f"unknown option {name}={value}; there are " + ", ".join(f"{k}={'|'.join(v)}" for k, v in OPTIONS.items()))
    record, figures = _race(race)
    model = "" if strategist in STRATEGISTS else model_hash(model_files(strategist))
    return Cell(
        strategist=strategist,
        race=race if race.endswith(".toml") else record.name,
        driver=record.cars[find_car(record, driver)].driver,
        seed=seed,
        races=races,
        first_race=first_race,
        options=tuple(sorted(options.items())),
        model_hash=model,
        race_hash=figures,
        code_hash=code_hash(),
    )


def run_cell(cell: Cell) -> dict[str, Any]:
    """Run a cell: plain types, and the same bits in any process on any number of threads, `timing` apart.

    Returns:
        lists by race: `position`, `points`, `stops`, `invalid` and `retired` 0 or 1, `driven` (the strategy as a plan is
        written, `S-H@14-S@36`); `laps` of the race; `common`, the commonest strategies; `timing` with `decision_ms`. Or
        `left_out` alone, the reason why this strategist cannot call this race.

    Raises:
        RsrlError: the model, the race's figures or the code are not those the cell was made for.
    """
    record, figures = _race(cell.race)
    for what, here, wanted in (("figures", figures, cell.race_hash), ("code", code_hash(), cell.code_hash)):
        if here != wanted:
            raise RsrlError(f"{cell.text}: the {what} here are not those the cell was made for; install the same RSRL everywhere")
    record = _varied(record, dict(cell.options))
    car = find_car(record, cell.driver)
    with threadpool_limits(1):  # cells run side by side; and the threads of a matrix product may change its last bit
        try:
            strategist = _strategist(cell, record, car)
        except _CannotCallError as error:
            return {"left_out": str(error)}
        log = run_races(strategist, record, car, cell.seed, cell.races, first_race=cell.first_race)
    return _as_json(log, record)


def model_files(model: str) -> dict[str, bytes]:
    """The files of a model, by name; raises RsrlError where there is no such model."""
    folder = find_model(model)
    try:
        return {name: (folder / name).read_bytes() for name in MODEL_FILES}
    except OSError as error:
        raise RsrlError(f"{folder}: holds no readable {Path(str(error.filename)).name}; give a folder made by `rsrl train`") from None


def model_hash(files: Mapping[str, bytes]) -> str:
    """First 16 hex digits of the SHA-256 of a model's files."""
    return hashlib.sha256(b"\0".join(files[name] for name in MODEL_FILES)).hexdigest()[:16]


@cache
def code_hash() -> str:
    """First 16 hex digits of the SHA-256 of the sources that decide how a race comes out."""
    digest = hashlib.sha256()
    for source in code_files():
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def code_files() -> list[Path]:
    """The files of `CODE`."""
    root = Path(__file__).parents[2]
    paths = [root / part for part in CODE]
    return [source for path in paths for source in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]


class _CannotCallError(Exception):
    """This strategist cannot call this race."""


def _strategist(cell: Cell, record: RaceRecord, car: int) -> Strategist:
    if not cell.model_hash:
        try:
            return make_strategist(cell.strategist, record, car)
        except RsrlError as error:
            raise _CannotCallError(str(error)) from None
    if model_hash(model_files(cell.strategist)) != cell.model_hash:
        raise RsrlError(f"{cell.strategist}: the model changed while the study ran; start the study again")
    agent, _ = load_agent(find_model(cell.strategist))
    return PolicyStrategist(agent, record, cell.strategist)


def _varied(record: RaceRecord, options: Mapping[str, str]) -> RaceRecord:
    if options.get("rivals") == "plans":
        return replace(record, rivals=replace(record.rivals, hazard={}, choice={}))
    return record


def _as_json(log: RaceLog, record: RaceRecord) -> dict[str, Any]:
    return {
        "laps": record.laps,
        "position": log.position.tolist(),
        "points": log.points.tolist(),
        "stops": log.stops.tolist(),
        "invalid": log.invalid.astype(int).tolist(),
        "retired": log.retired.astype(int).tolist(),
        "driven": [str(Plan(*log.stints(i))) for i in range(len(log.races))],
        "common": [_common(c) for c in common_strategies(log)],
        "timing": {"decision_ms": log.decision_ms},
    }


def _common(strategy: CommonStrategy) -> dict[str, Any]:
    """A strategy as JSON has it, without the strategist, which may be a path."""
    return {name: value for name, value in plain(strategy).items() if name != "strategist"}


def _race(race: str) -> tuple[RaceRecord, str]:
    """A race's record and hash, read again if its file has changed."""
    path = Path(race) if race.endswith(".toml") else shipped_folder() / f"{race}.toml"
    return _read(race, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=256)
def _read(race: str, changed: int) -> tuple[RaceRecord, str]:
    record = load_race(race)
    return record, race_hash(record)
