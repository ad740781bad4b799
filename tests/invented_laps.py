"""Laps written out by hand, for tests of what is read from a lap table."""

from typing import Any

import polars as pl

from rsrl.laps import LAP_SCHEMA, check_table


def race(drivers: int = 4, laps: int = 20, season: int = 2023) -> list[dict[str, Any]]:
    """Cars two seconds apart, all laps 90 s on softs, green."""
    rows = []
    for d in range(drivers):
        for lap in range(1, laps + 1):
            rows.append(
                dict.fromkeys(LAP_SCHEMA)
                | {
                    "season": season,
                    "round": 1,
                    "event": "Test Grand Prix",
                    "driver": f"D{d:02d}",
                    "team": f"T{d // 2}",
                    "lap": lap,
                    "lap_time_s": 90.0,
                    "compound": "S",
                    "compound_c": "C3",
                    "tyre_life_laps": float(lap),
                    "stint": 1,
                    "position": d + 1,
                    "track_status": "1",
                    "session_time_s": 3600.0 + 90.0 * lap + 2.0 * d,
                    "fresh_tyre": True,
                    "lap_time_source": "timing",
                }
            )
    return rows


def table(rows: list[dict[str, Any]]) -> pl.DataFrame:
    return check_table(pl.DataFrame(rows, schema=LAP_SCHEMA), "test", 0)


def row(rows: list[dict[str, Any]], driver: int, lap: int) -> dict[str, Any]:
    return next(r for r in rows if r["driver"] == f"D{driver:02d}" and r["lap"] == lap)


def passage(rows: list[dict[str, Any]], driver: int, lap: int, lane_s: float = 25.0) -> None:
    """Through the pit lane at the end of a lap; the tyre record goes on."""
    row(rows, driver, lap)["pit_in_s"] = 1.0
    row(rows, driver, lap + 1)["pit_out_s"] = 1.0 + lane_s


def new_set(rows: list[dict[str, Any]], driver: int, lap: int, compound: str = "H") -> None:
    """A new set in the tyre record from this lap on."""
    for r in rows:
        if r["driver"] == f"D{driver:02d}" and r["lap"] >= lap:
            r.update(compound=compound, tyre_life_laps=float(r["lap"] - lap + 1), stint=r["stint"] + 1)


def stop(rows: list[dict[str, Any]], driver: int, lap: int, compound: str = "H", lane_s: float = 25.0) -> None:
    """New tyres at the end of a lap, recorded as they should be."""
    passage(rows, driver, lap, lane_s)
    new_set(rows, driver, lap + 1, compound)
