"""Race records to and from TOML, one file a race. A missing, mistyped or implausible figure is refused by name."""

import dataclasses
import hashlib
import json
import re
import tomllib
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

from rsrl.errors import RsrlError
from rsrl.season.bounds import bounds_of
from rsrl.season.records import Figure, RaceRecord
from rsrl.season.tyre_sets import impossible_sets
from rsrl.season.vocabulary import COMPOUNDS, FEWEST_SETS, FOLLOWING_AIDS, MAX_CARS
from rsrl.text_files import read_text

SCHEMA = 1
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_KIND_NAMES = {float: "a finite number", int: "a whole number", str: "text", bool: "true or false"}
_SLUG = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_WHOLE_BOUNDS = {
    "season": (1950, 2100),
    "round": (1, 40),
    "laps": (10, 90),
    "max_laps_per_set": (0, 90),
    "min_sets": (FEWEST_SETS, 13),
    "drs_off_laps": (0, 10),
}


def read_race(path: Path) -> RaceRecord:
    """Read and check a season file.

    Raises:
        RsrlError: the file cannot be read, is not TOML, or lacks a figure, has one of the wrong type or
            one outside `bounds`; the message names file and figure.
    """
    try:
        document = tomllib.loads(read_text(path))
    except OSError as error:
        raise RsrlError(f"{path}: cannot be read ({error.strerror}); give a season file made by `rsrl calibrate`") from None
    except UnicodeDecodeError:
        raise RsrlError(f"{path}: not a text file; give a season file made by `rsrl calibrate`") from None
    except tomllib.TOMLDecodeError as error:
        raise RsrlError(f"{path}: not a TOML file ({error}); make it again with `rsrl calibrate`") from None
    if document.pop("schema", None) != SCHEMA:
        raise RsrlError(f"{path}: not a season file of schema {SCHEMA}; make it again with `rsrl calibrate`")
    record = _build(RaceRecord, document, str(path), "")
    _check_whole(record, str(path))
    return record


def write_race(record: RaceRecord, path: Path) -> None:
    """Write a season file, over an existing one if there is. Raises RsrlError if the place cannot be written to."""
    lines = [f"schema = {SCHEMA}"]
    _dump(record, "", lines)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder with --out") from None


def race_hash(record: RaceRecord) -> str:
    """First 16 hex digits of the SHA-256 of a record's figures, without provenance: identifies what a model was trained on."""
    bare = dataclasses.replace(record, provenance=dataclasses.replace(record.provenance, command="", date="", version=""))
    lines: list[str] = []
    _dump(bare, "", lines)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def _build(kind: Any, value: Any, where: str, key: str) -> Any:
    """Turn parsed TOML into `kind`, naming `key` in any complaint."""
    kind = _if_given(kind)
    origin = get_origin(kind)
    if kind is Figure:
        return _build_figure(value, where, key)
    if dataclasses.is_dataclass(kind):
        return _build_record(kind, value, where, key)
    if origin is tuple:
        return _build_tuple(get_args(kind), value, where, key)
    if origin is dict:
        if not isinstance(value, dict):
            raise RsrlError(f"{where}: {key} must be a table")
        return {k: _build(get_args(kind)[1], v, where, f"{key}.{k}") for k, v in value.items()}
    right = _is_number(value) if kind is float else isinstance(value, kind) and not (kind is int and isinstance(value, bool))
    if not right:
        raise RsrlError(f"{where}: {key} must be {_KIND_NAMES[kind]}, found {value!r}")
    return kind(value)


def _if_given(kind: Any) -> Any:
    """The type of a field where it is given: TOML has no null, so a field that may be None is left out instead."""
    return get_args(kind)[0] if isinstance(kind, UnionType) else kind


def _is_number(value: Any) -> bool:
    """Whether a TOML value is a finite number of plausible size."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -1e15 < value < 1e15


def _build_record(kind: Any, value: Any, where: str, key: str) -> Any:
    if not isinstance(value, dict):
        raise RsrlError(f"{where}: {key or 'the file'} must be a table")
    hints = get_type_hints(kind)
    arguments = {}
    for f in dataclasses.fields(kind):
        name = f"{key}.{f.name}" if key else f.name
        if f.name in value:
            arguments[f.name] = _build(hints[f.name], value[f.name], where, name)
        elif f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING:
            raise RsrlError(f"{where}: {name} is missing; make the file again with `rsrl calibrate`")
    unknown = sorted(set(value) - {f.name for f in dataclasses.fields(kind)})
    if unknown:
        raise RsrlError(f"{where}: {key + '.' if key else ''}{unknown[0]} is not a known figure; remove it")
    return kind(**arguments)


def _build_tuple(inner: tuple[Any, ...], value: Any, where: str, key: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise RsrlError(f"{where}: {key} must be a list, found {value!r}")
    kinds = [inner[0]] * len(value) if inner[-1] is Ellipsis else list(inner)
    if len(kinds) != len(value):
        raise RsrlError(f"{where}: {key} must have {len(kinds)} entries, found {len(value)}")
    return tuple(_build(k, v, where, f"{key}[{i}]") for i, (k, v) in enumerate(zip(kinds, value, strict=True)))


def _build_figure(value: Any, where: str, key: str) -> Figure:
    if not isinstance(value, dict) or not {"value", "se", "n"} <= set(value):
        raise RsrlError(f"{where}: {key} must be a figure with value, se and n, found {value!r}")
    unknown = sorted(set(value) - set(Figure._fields))
    if unknown:
        raise RsrlError(f"{where}: {key}.{unknown[0]} is not a part of a figure; remove it")
    kinds = get_type_hints(Figure)
    figure = Figure(**{part: _build(kinds[part], item, where, f"{key}.{part}") for part, item in value.items()})
    low, high = bounds_of(key)
    if not low <= figure.value <= high:
        raise RsrlError(f"{where}: {key} is {figure.value:g}, outside the believable range {low:g} to {high:g}")
    if figure.se < 0 or figure.n < 0:
        raise RsrlError(f"{where}: {key} has a negative standard error or sample size")
    return figure


def _check_whole(record: RaceRecord, where: str) -> None:
    """Checks across figures: sums, sizes, names that must exist."""
    if set(record.tyres) != set(COMPOUNDS):
        raise RsrlError(f"{where}: tyres must be exactly {', '.join(COMPOUNDS)}, found {', '.join(sorted(record.tyres))}")
    if not 2 <= len(record.cars) <= MAX_CARS:
        raise RsrlError(f"{where}: {len(record.cars)} cars; a race has 2 to {MAX_CARS}")
    drivers = [car.driver for car in record.cars]
    if len(set(drivers)) != len(drivers):
        raise RsrlError(f"{where}: a driver is listed twice in cars")
    if record.default_driver not in drivers:
        raise RsrlError(f"{where}: default_driver {record.default_driver} is not among the cars")
    grid = [car.grid for car in record.cars]
    if grid != sorted(set(grid)) or not 1 <= grid[0] <= grid[-1] <= MAX_CARS:
        raise RsrlError(f"{where}: cars must stand in grid order, each on a place of its own from 1 to {MAX_CARS}")
    for figure, (low, high) in _WHOLE_BOUNDS.items():
        if not low <= getattr(record, figure) <= high:
            raise RsrlError(f"{where}: {figure} is {getattr(record, figure)}, outside the believable range {low} to {high}")
    if not _SLUG.fullmatch(record.grand_prix):
        raise RsrlError(f"{where}: grand_prix is {record.grand_prix!r}; write it in small letters and hyphens, such as great-britain")
    if record.name != f"{record.grand_prix}-{record.season}":
        raise RsrlError(f"{where}: name is {record.name!r}, but the race is {record.grand_prix}-{record.season}")
    for key in ("sc_laps", "vsc_laps"):
        shares = getattr(record.incidents, key)
        if not shares or len(shares) > 20 or min(shares) < 0 or abs(sum(shares) - 1) > 1e-3:
            raise RsrlError(f"{where}: incidents.{key} must be 1 to 20 probabilities that sum to 1")
    caused = [f.value for f in (record.incidents.sc_per_retirement, record.incidents.vsc_per_retirement) if f]
    if sum(caused) > 1:
        raise RsrlError(f"{where}: incidents.sc_per_retirement and vsc_per_retirement must not sum to more than 1, found {sum(caused):g}")
    if not record.rivals.plans or min(p.weight for p in record.rivals.plans) <= 0:
        raise RsrlError(f"{where}: rivals.plans must hold at least one plan, each of positive weight")
    if any(t.sets < 0 for t in record.tyres.values()) or sum(record.sets) < 2:
        raise RsrlError(f"{where}: tyres.*.sets must be zero or more and two in all at least")
    for car in record.cars:
        if car.sets is not None and (why := impossible_sets(car.sets, record.laps, record.max_laps_per_set)):
            raise RsrlError(f"{where}: cars.sets of {car.driver}: {why}")
    _check_rules(record, where)


def _check_rules(record: RaceRecord, where: str) -> None:
    """Refuse rules that are unknown, and those that no plan can meet with the sets a car has."""
    if record.following_aid not in FOLLOWING_AIDS:
        raise RsrlError(f"{where}: following_aid is {record.following_aid!r}; known are {', '.join(FOLLOWING_AIDS)}")
    sets, limit = sum(record.sets), record.max_laps_per_set
    if record.min_sets > sets:
        raise RsrlError(f"{where}: no plan can use {record.min_sets} sets (min_sets): a car has {sets}")
    if sum(count > 0 for count in record.sets) < 2:
        raise RsrlError(f"{where}: no plan can use two compounds: a car has sets of one only")
    if limit and limit * sets < record.laps:
        raise RsrlError(f"{where}: no plan reaches the flag: {sets} sets of {limit} laps at most (max_laps_per_set), {record.laps} laps")


def _dump(value: Any, key: str, lines: list[str]) -> None:
    """Append a record as TOML: scalars first, then sub-tables, so that every table is written once. A default is left out."""
    nested: list[tuple[str, Any, Any]] = []
    for f in dataclasses.fields(value):
        item = getattr(value, f.name)
        if item is None or item == f.default:
            continue
        if dataclasses.is_dataclass(item) or isinstance(item, dict) or _is_record_list(item):
            nested.append((f.name, item, _if_given(f.type)))
        else:
            lines.append(f"{f.name} = {_literal(item, f.type)}")
    for name, item, kind in nested:
        path = f"{key}.{name}" if key else name
        if _is_record_list(item):
            for entry in item:
                lines.extend(["", f"[[{path}]]"])
                _dump(entry, path, lines)
        elif isinstance(item, dict):
            _dump_dict(item, path, lines, get_args(kind)[1])
        else:
            lines.extend(["", f"[{path}]"])
            _dump(item, path, lines)


def _dump_dict(item: dict[str, Any], path: str, lines: list[str], kind: Any) -> None:
    if all(dataclasses.is_dataclass(v) for v in item.values()) and item:
        for k, v in item.items():
            lines.extend(["", f"[{path}.{k}]"])
            _dump(v, f"{path}.{k}", lines)
    else:
        lines.extend(["", f"[{path}]"])
        lines.extend(f"{k if _BARE_KEY.fullmatch(k) else _literal(k, str)} = {_literal(v, kind)}" for k, v in item.items())


def _is_record_list(item: Any) -> bool:
    return isinstance(item, tuple) and bool(item) and dataclasses.is_dataclass(item[0])


def _literal(value: Any, kind: Any) -> str:
    """TOML for a value of a field of type `kind`; an int in a float field is written as a float."""
    if isinstance(value, Figure):
        note = f", note = {_literal(value.note, str)}" if value.note else ""
        return f"{{ value = {value.value:.6g}, se = {value.se:.3g}, n = {value.n}{note} }}"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_literal(v, get_args(kind)[0]) for v in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # JSON's escapes are TOML's, but for DEL
    if isinstance(value, bool):
        return "true" if value else "false"
    if kind is float:
        text = f"{value:.6g}"
        return text if set(text) & set(".en") else f"{text}.0"
    if isinstance(value, int):
        return str(value)
    raise TypeError(f"no TOML form for {value!r}")
