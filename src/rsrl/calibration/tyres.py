"""Tyre figures of the target season, read from the pace model."""

import polars as pl

from rsrl.calibration.pace import PaceModel
from rsrl.season import COMPOUNDS, Figure, TyreFigures


def tyre_figures(model: PaceModel, cold_s: dict[str, Figure], sets: dict[str, int]) -> dict[str, TyreFigures]:
    """Offset, wear and curvature of each compound; `cold_s` and `sets` by letter come from the pit fit and the rivals."""
    return {letter: _compound(model, letter, cold_s[letter], sets[letter]) for letter in COMPOUNDS}


def _compound(model: PaceModel, letter: str, cold_s: Figure, sets: int) -> TyreFigures:
    c = model.c_numbers[letter]
    laps = model.laps.filter(pl.col("compound_c") == c)
    now = laps.filter(pl.col("season") == model.season).height
    note = f"{now} laps of {model.season}, {laps.height - now} of other seasons, with priors of docs/calibration.md"
    oldest = max(laps["age_laps"].to_list(), default=0)
    reach = f"; seen up to age {oldest}, beyond is extrapolation"
    medium = model.c_numbers["M"]
    offset = model.tyre_terms("offset", letter)
    offset[f"offset {medium} {model.season}"] = offset.get(f"offset {medium} {model.season}", 0.0) - 1.0
    value, se = model.fit.combine(offset)
    wear, wear_se = model.fit.combine(model.tyre_terms("wear", letter))
    return TyreFigures(
        c_number=c,
        offset_s=Figure(0.0, 0.0, laps.height, "the reference") if letter == "M" else Figure(value, se, laps.height, note),
        wear_s_per_lap=Figure(wear, wear_se, laps.height, note + reach),
        curvature_s_per_lap2=_curvature(model, letter, laps.height),
        cold_loss_s=cold_s,
        sets=sets,
    )


def _curvature(model: PaceModel, letter: str, n: int) -> Figure:
    name = f"curvature {model.c_numbers[letter]}"
    if name not in model.fit:
        return Figure(0.0, 0.0, n, "the data show no wear that grows with age (under 2.5 standard errors): left out")
    value, se = model.fit.combine({name: 1.0})
    return Figure(value, se, n)
