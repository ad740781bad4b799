"""What result files must hold for a report: shapes, and a check that says where a file differs.

A shape is a type, a set of values, a list of one shape, a mapping of names to shapes, `Maybe` of a shape, or a function that checks.
"""

from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any, Final, NamedTuple

from rsrl.season import COMPOUNDS


class Maybe(NamedTuple):
    """A shape, or null, or left out."""

    shape: Any


class ShapeError(Exception):
    """A value is not of its shape; the message says where, and what is wrong."""


Check = Callable[[Any, str], None]


def check(value: Any, shape: Any, where: str = "") -> None:
    """Raise ShapeError where `value`, parsed JSON, is not of a shape; more than a shape asks for is allowed."""
    if isinstance(shape, Maybe):
        if value is not None:
            check(value, shape.shape, where)
    elif isinstance(shape, Mapping):
        _expect(isinstance(value, Mapping), where, "is no object")
        for name, part in shape.items():
            path = f"{where}.{name}" if where else name
            _expect(name in value or isinstance(part, Maybe), path, "is missing")
            check(value.get(name), part, path)
    elif isinstance(shape, list):
        _expect(isinstance(value, list), where, "is no list")
        for i, item in enumerate(value):
            check(item, shape[0], f"{where}[{i}]")
    elif isinstance(shape, frozenset):
        _expect(any(type(value) is type(one) and value == one for one in shape), where, f"is none of {', '.join(map(str, sorted(shape)))}")
    elif isinstance(shape, type):
        _expect(_is(value, shape), where, f"is no {NAMES[shape]}")
    else:
        shape(value, where)


NAMES: Final = {str: "text", int: "whole number", float: "number", bool: "true or false"}


def _is(value: Any, kind: type) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return isinstance(value, kind) and (kind is bool or not isinstance(value, bool))


def _expect(true: bool, where: str, complaint: str) -> None:
    if not true:
        raise ShapeError(f"{where or 'the whole'} {complaint}")


def _interval(value: Any, where: str) -> None:
    check(value, [Maybe(float)], where)
    _expect(len(value) == 2, where, "has not two ends")


def _date(value: Any, where: str) -> None:
    check(value, str, where)
    try:
        datetime.fromisoformat(value)
    except ValueError:
        raise ShapeError(f"{where} is no date") from None


def _strategy(value: Any, where: str) -> None:
    check(value, STRATEGY, where)
    for name in ("laps", "windows"):
        _expect(len(value[name]) == len(value["compounds"]) - 1, f"{where}.{name}", "has not one entry for each stop")
    for i, window in enumerate(value["windows"]):
        _expect(len(window) == 2, f"{where}.windows[{i}]", "has not two ends")


def _strategy_at_a_race(value: Any, where: str) -> None:
    check(value, {"race": str, "text": str}, where)
    _strategy(value, where)


def _values_by_name(value: Any, where: str) -> None:
    _expect(isinstance(value, Mapping), where, "is no object")
    for name, one in value.items():
        check(one, Maybe(float), f"{where}.{name}")


def _method(value: Any, where: str) -> None:
    check(value, METHOD, where)
    if value["method"] in ROWS:
        check(value["rows"], [ROWS[value["method"]]], f"{where}.rows")


METHOD: Final = {
    "method": str, "question": str, "unit": str, "baseline": Maybe(float), "exact": bool, "budget": int, "sentences": [str],
    "rows": [{"label": str, "value": Maybe(float), "standard_error": Maybe(float)}],
}  # fmt: skip
ROWS: Final = {
    "summary": {"lap": int, "call": str, "for_a_stop": Maybe(float), "status": str, "mattered": str},
    "safety-car table": {
        "lap": int, "compound": frozenset(COMPOUNDS), "tyre_age_laps": int, "on_plan": bool, "share_of_races": float,
        "track_status": str, "call": str, "share_calling_it": float, "value": float, "standard_error": float,
    },
}  # fmt: skip
"""What the rows of some methods must hold besides."""

INTERVAL: Final = Maybe(_interval)
COMPOUND: Final = frozenset(range(len(COMPOUNDS)))
STRATEGY: Final = {
    "strategist": str, "plan": str, "share": float, "compounds": [COMPOUND], "laps": [int], "windows": [[int]], "mean_position": float,
}  # fmt: skip
PROVENANCE: Final = {
    "command": str, "seed": Maybe(int), "version": str, "date": _date,
    "machine": {"cpu": str, "cores": int, "python": str, "platform": str}, "engine": Maybe(str),
}  # fmt: skip

DIFFERENCE: Final = {"strategist": str, "difference": float, "ci95": INTERVAL, "p_ahead": float}
CRITERION: Final = Maybe(bool)
SCORED: Final = {
    "races": [{"race": str, "track": str, "code": str, "event": str, "season": int, "laps": int, "driver": str, "unseen": bool}],
    "table": [
        {
            "strategist": str, "race": str, "races": int, "mean_position": float, "ci95": INTERVAL, "mean_stops": float,
            "invalid_share": float, "retired_share": float, "trained": bool, "best": bool,
        }
    ],
    "averages": [{"strategist": str, "over": str, "tracks": int, "mean_position": float, "ci95": INTERVAL}],
    "differences": [DIFFERENCE | {"race": str, "against": str, "tracks": int}],
    "best_baselines": [{"race": str, "baseline": str, "models": [DIFFERENCE]}],
    "criteria": [
        {
            "strategist": str, "race": str, "strategy": str, "few_stops": CRITERION, "harder_longer": CRITERION,
            "like_or_better": CRITERION, "reasonable": CRITERION,
        }
    ],
    "strategies": [_strategy_at_a_race],
    "gap_closed": [{"strategist": str, "race": str, "tracks": int, "share": Maybe(float), "ci95": INTERVAL}],
}  # fmt: skip
BY_CAR: Final = {"driver": str, "grid": int, "mean_position": float, "difference": float, "ci95": INTERVAL}
GENERALISE: Final = {
    "seed": int,
    "first_race": int,
    "reference": Maybe(str),
    "strategists": [
        {"strategist": str, "kind": frozenset({"model", "baseline", "bound"}), "races": int, "trained_on": [str], "model_hash": Maybe(str)}
    ],
    "tracks": SCORED,
    "held_out": Maybe(SCORED),
    "cars": [
        {
            "race": str, "strategist": str, "against": str, "cars": int, "ahead": int, "surely_ahead": int, "surely_behind": int,
            "difference": float, "ci95": INTERVAL, "by_car": [BY_CAR],
        }
    ],
    "left_out": [{"strategist": str, "race": str, "reason": str}],
    "provenance": PROVENANCE,
}  # fmt: skip
"""`generalise.json`, of `rsrl study generalise`."""

EVALUATION: Final = {
    "race": str,
    "driver": str,
    "races": int,
    "seed": int,
    "warnings": Maybe([str]),
    "rows": [
        {
            "strategist": str, "mean_position": float, "ci95": INTERVAL, "difference": float, "difference_ci95": INTERVAL,
            "p_better": float, "mean_points": float, "mean_stops": float, "invalid_share": float, "retired_share": float,
            "decision_ms": float, "gap_closed": Maybe(float), "gap_closed_ci95": INTERVAL,
        }
    ],
    "aggregate": Maybe(
        {
            "seeds": int, "mean_position": float, "mean_position_ci95": INTERVAL, "iqm_position": float, "iqm_position_ci95": INTERVAL,
            "comparisons": [
                {"strategist": str, "difference": float, "difference_ci95": INTERVAL, "p_better": float, "p_better_ci95": INTERVAL}
            ],
        }
    ),
    "strategies": Maybe([_strategy]),
    "provenance": PROVENANCE,
}  # fmt: skip
"""`evaluation.json`, of `rsrl evaluate --out` and `rsrl demo --out`."""

ROBUSTNESS: Final = {
    "race": str,
    "driver": str,
    "model": str,
    "plan": {"informed": bool},
    "rows": [
        {
            "rivals": str, "scale": float, "draws": int, "races": int, "mean_position": float, "ci95": INTERVAL,
            "against": [
                {"strategist": str, "mean_position": float, "difference": float, "difference_ci95": INTERVAL, "p_better": float}
            ],
        }
    ],
    "provenance": PROVENANCE,
}  # fmt: skip
"""`robustness.json`, of `rsrl study robustness`."""

EXPLANATION: Final = {
    "race": str,
    "driver": str,
    "lap": Maybe(int),
    "model": str,
    "model_hash": str,
    "warnings": [str],
    "notes": Maybe([str]),
    "value_unit": Maybe(str),
    "decision": Maybe(
        {
            "model": str, "model_hash": str, "lap": int, "call": str, "alternative": str, "margin": Maybe(float), "legal": [str],
            "q_values": _values_by_name,
        }
    ),
    "explanations": [_method],
    "paper": Maybe([{"question": str, "paper": str, "ours": str, "agrees": Maybe(bool)}]),
    "provenance": PROVENANCE,
}  # fmt: skip
"""`explanation.json`, of `rsrl explain --json`."""
