"""Tables of `rsrl backtest`: seasons predicted, what each part is worth, and the forecast beside its baselines over all seasons."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from table_text import interval, markdown, with_nan

from rsrl.evaluation.backtest.scores import differences
from rsrl.statistics import bootstrap_over_races

RESULTS = Path(__file__).parent / "results"
SEASONS = (2023, 2024, 2025)
"""Seasons forecast from those before them."""


MEASURES = {"mae_position": 2, "mae_rank_classified": 2, "spearman": 3, "brier_points": 3, "logloss_winner": 2, "mae_green_lap_s": 2,
            "mae_lap_position": 2}  # fmt: skip
MEASURE_HEADS = ("position", "rank", "Spearman", "Brier of P(points)", "log-loss of winner", "green lap, s", "position by lap")


def backtest(season: int) -> str:
    """A season predicted: baselines and the three modes."""
    forecast = _result(f"backtest-{season}-forecast")
    told = {"grid": forecast["baselines"]["grid"], "regression": forecast["baselines"]["regression"]}
    told |= {f"**{mode}**": _result(f"backtest-{season}-{mode}")["overall"] for mode in ("forecast", "replay", "hindsight")}
    rows = [[name, *("" if row[m] is None else f"{row[m]:.{d}f}" for m, d in MEASURES.items())] for name, row in told.items()]
    return markdown(["", *MEASURE_HEADS], rows)


def ablations() -> str:
    """Parts of the simulator taken out, 2024."""
    shown = {m: d for m, d in MEASURES.items() if m not in ("spearman", "logloss_winner")}
    rows = []
    for mode in ("replay", "hindsight"):
        whole = _result(f"backtest-2024-{mode}")
        rows.append([f"**{mode}**", *(f"{whole['overall'][m]:.{d}f}" for m, d in shown.items())])
        for part in ("traffic", "safety-cars", "wear"):
            apart = differences(_dry(_result(f"backtest-2024-{mode}-without-{part}")), _dry(whole))
            cells = [interval(apart[m].mean, (apart[m].low, apart[m].high), d) for m, d in shown.items()]
            rows.append([f"without {part}", *cells])
    return markdown(["", "position", "rank", "Brier", "green lap, s", "position by lap"], rows)


def _dry(document: Any) -> list[dict[str, Any]]:
    """The dry races of a backtest, null as NaN."""
    return [with_nan(race) for race in document["races"] if not race["wet"]]


def forecast_seasons() -> str:
    """The forecast beside its baselines, season by season and over all of them, by bootstrap over races."""
    races = {season: _dry(_result(f"backtest-{season}-forecast")) for season in SEASONS}
    told = [(str(season), rows) for season, rows in races.items()] + [("all", [row for rows in races.values() for row in rows])]
    rows = []
    for name, dry in told:
        errors = [f"{np.mean([row['mae_position'] for row in kind]):.2f}" for kind in (dry, _of(dry, "grid"), _of(dry, "regression"))]
        apart = [_apart(dry, base, measure) for measure in ("mae_position", "brier_points") for base in ("grid", "regression")]
        rows.append([name, str(len(dry)), *errors, *apart])
    heads = ("position", "grid's", "regression's", "less grid's", "less regression's", "Brier, less grid's", "less regression's")
    return markdown(["", "races", *heads], rows)


def _of(dry: list[dict[str, Any]], base: str) -> list[dict[str, Any]]:
    return [race[base] for race in dry]


def _apart(dry: list[dict[str, Any]], base: str, measure: str) -> str:
    apart = np.array([race[measure] - race[base][measure] for race in dry])
    low, high = bootstrap_over_races(apart)
    return interval(float(apart.mean()), (float(low), float(high)), MEASURES[measure])


@cache
def _result(name: str) -> Any:
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
