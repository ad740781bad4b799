"""Neutralisations of one race: when, how long, how slow."""

from dataclasses import dataclass
from typing import Final

import polars as pl

from rsrl.laps import RED, neutralised_laps, with_gaps, with_status, with_stint_ages
from rsrl.season import SC, VSC

RED_SHARE: Final = 0.3  # of the cars that saw the red flag on a lap, for it to be one


@dataclass(frozen=True)
class Deployment:
    """One neutralisation."""

    lap: int  # first slow lap
    status: int  # SC or VSC: a VSC that turns into a safety car is one safety car, and so is a red flag
    excess: tuple[float, ...]  # of each slow lap over a green one, as a share
    red: bool


@dataclass(frozen=True)
class IncidentAnalysis:
    """Neutralisations of one race. Ratios are lap times over the race's median green lap."""

    laps: int  # raced
    green_s: float
    deployments: tuple[Deployment, ...]
    leader: tuple[float, ...]  # the leader's second and later laps behind the safety car
    closing: tuple[float, ...]  # laps of cars 3-15 s behind the next one on the first two laps of it
    virtual: tuple[float, ...]
    queue_gap_s: tuple[float, ...]  # of queuing cars at the line


def analyse_incidents(race: pl.DataFrame) -> IncidentAnalysis:
    """Neutralisations of one race, and lap times under them."""
    laps = with_status(with_gaps(with_stint_ages(race))).filter(~pl.col("in_lap") & ~pl.col("out_lap"))
    green_s = float(laps.filter((pl.col("status") == 0) & (pl.col("lap") > 1))["lap_time_s"].median())  # type: ignore[arg-type]
    slow = neutralised_laps(race).with_columns(run=(pl.col("lap").diff() > 2).fill_null(True).cum_sum())
    slow = slow.with_columns(nth=(pl.col("lap") - pl.col("lap").min() + 1).over("run"))
    laps = laps.join(slow.rename({"status": "race_status"}).select("lap", "race_status", "nth"), on="lap")
    laps = (
        laps.with_columns(ratio=pl.col("lap_time_s") / green_s)
        .filter(pl.col("ratio").is_not_null() & (pl.col("ratio") < 2.5))
        .sort("lap", "driver")
    )
    behind = laps.filter(pl.col("race_status") == SC)
    queue = behind.filter((pl.col("nth") >= 3) & (pl.col("position") > 1) & (pl.col("gap_ahead_s") < 3.0))
    closing = behind.filter(
        (pl.col("nth") <= 2) & pl.col("gap_start_s").is_between(3.0, 15.0) & (pl.col("gap_ahead_s") < pl.col("gap_start_s"))
    )
    return IncidentAnalysis(
        laps=int(race["lap"].max()),  # type: ignore[arg-type]
        green_s=green_s,
        deployments=_deployments(slow, _red_laps(race)),
        leader=tuple(behind.filter((pl.col("nth") >= 2) & (pl.col("position") == 1))["ratio"]),
        closing=tuple(closing["ratio"]),
        virtual=tuple(laps.filter(pl.col("race_status") == VSC)["ratio"]),
        queue_gap_s=tuple(queue["gap_ahead_s"]),
    )


def _red_laps(race: pl.DataFrame) -> list[int]:
    """Laps on which the race was stopped."""
    shares = with_status(race).group_by("lap").agg(share=(pl.col("status") == RED).mean())
    return sorted(shares.filter(pl.col("share") >= RED_SHARE)["lap"])


def _deployments(slow: pl.DataFrame, red_laps: list[int]) -> tuple[Deployment, ...]:
    found = []
    for _, run in slow.sort("lap").group_by("run", maintain_order=True):
        first, last = int(run["lap"][0]), int(run["lap"][-1])
        red = any(first - 1 <= lap <= last + 1 for lap in red_laps)
        moving = run.filter(pl.col("status") != RED)
        excess = tuple(float(v) - 1.0 for v in moving["factor"].fill_null(1.5))
        found.append(Deployment(first, SC if red else int(run["status"].max()), excess or (0.5,), red))  # type: ignore[arg-type]
    covered = [lap for d in found if d.red for lap in range(d.lap - 1, d.lap + len(d.excess) + 2)]
    alone = [lap for lap in red_laps if lap not in covered and lap - 1 not in red_laps]
    return tuple(sorted([*found, *(Deployment(lap, SC, (0.5,), True) for lap in alone)], key=lambda d: d.lap))
