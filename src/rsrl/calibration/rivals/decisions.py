"""Real decisions to box or stay out: one row per car and lap, with what the pit wall knew and what it did.

A decision for lap n knows the race up to the line at the end of lap n - 1 and the track status of lap n, as in the compiled race.
Only dry races count. Lap 1 and the last lap hold no decision, nor does a lap under a red flag, where a change of tyres costs nothing.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.calibration.entry import RaceKey
from rsrl.calibration.race_facts import RaceFacts, starters_only
from rsrl.calibration.rivals.stint_lengths import RaceSummary, summarise_race
from rsrl.laps import BROKEN_RACES, RED, WET, tyre_stops, with_status
from rsrl.season import COMPOUNDS, GREEN, grand_prix_of
from rsrl.season.rival_features import UNDERCUT_S

FAR_S: Final = 60.0
"""Gaps are capped here, which is also the gap where there is no car."""

DAMAGE_LAPS: Final = 4
"""A set taken off on a racing lap after so few laps was damaged or the wrong one: no decision to be learned from."""

DASH_LAPS: Final = 5
"""A stop on a racing lap this close to the flag, by a car that has used two compounds, aims at the fastest lap: left out too."""

USUAL_STOP_S: Final = 21.0  # time lost by a stop, where a race has too few to measure it

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class RaceDecisions:
    """The decisions and stints of one race.

    Attributes:
        key: season, round, Grand Prix, classified distance, and C-numbers where the lap file has them.
        rows: one decision a row (`_rows` lists the columns); empty where anyone ran on wet tyres, and where no tyre is on record.
        stints: one row per stint on a known compound: `driver, compound` (code), `laps, first` (of the race) and `ended`, one of `box`,
            `slow` (boxed under SC or VSC), `red`, `odd` (damage, or a stop for the fastest lap), `flag`, `out`.
        summary: usual stints and stops of the race, for forecasts of others; None where there are no decisions.
    """

    key: RaceKey
    rows: pl.DataFrame
    stints: pl.DataFrame
    summary: RaceSummary | None


def race_decisions(table: pl.DataFrame, facts: RaceFacts, season: int, round_number: int) -> RaceDecisions:
    """The decisions of one race of a lap table; no other race is looked at."""
    race = table.filter((pl.col("season") == season) & (pl.col("round") == round_number) & (pl.col("lap") <= facts.laps))
    race = starters_only(race, facts)
    event = str(race["event"][0])
    c_numbers = {c: str(n) for c, n in race.select("compound", "compound_c").drop_nulls().unique().sort("compound").iter_rows()}
    wet = bool(race["compound"].is_in(list(WET)).any()) or (season, round_number) in BROKEN_RACES
    dry_numbers = {c: n for c, n in c_numbers.items() if c in COMPOUNDS}
    key = RaceKey(season, round_number, grand_prix_of(event), facts.laps, dry_numbers)
    if wet:
        return RaceDecisions(key, pl.DataFrame(), pl.DataFrame(), None)
    laps = _RaceLaps(race, facts)
    stints, rows = laps.stints(), _rows(laps, season, round_number)
    if rows.is_empty():
        return RaceDecisions(key, rows, stints, None)
    return RaceDecisions(key, rows, stints, summarise_race(stints, facts.laps))


class _RaceLaps:
    """One race as matrices [cars, laps + 1] by lap number; column 0 is before the start."""

    def __init__(self, race: pl.DataFrame, facts: RaceFacts) -> None:
        self.laps, self.retired = facts.laps, facts.retired
        self.drivers = sorted(set(race["driver"]))
        teams = dict(race.select("driver", "team").unique(subset="driver").iter_rows())
        self.teams = np.array([teams[d] for d in self.drivers])
        self.grid = np.array([facts.grid.get(d, 20) for d in self.drivers])
        shape = (len(self.drivers), self.laps + 1)
        self.at = {d: i for i, d in enumerate(self.drivers)}
        laps = with_status(race)
        rows, cols = np.array([self.at[d] for d in laps["driver"]]), laps["lap"].to_numpy()
        self.time = np.full(shape, np.nan)
        self.time[rows, cols] = laps["session_time_s"].cast(pl.Float64).fill_null(float("nan")).to_numpy()
        self.lap_s = np.full(shape, np.nan)
        self.lap_s[rows, cols] = laps["lap_time_s"].cast(pl.Float64).fill_null(float("nan")).to_numpy()
        self.status = np.zeros(shape, np.int64)
        self.status[rows, cols] = laps["status"].to_numpy()
        self.run = np.zeros(shape, bool)
        self.run[rows, cols] = True
        codes = laps["compound"].replace_strict({c: i for i, c in enumerate(COMPOUNDS)}, default=-1, return_dtype=pl.Int64)
        self.compound = np.full(shape, -1, np.int64)
        self.compound[rows, cols] = codes.to_numpy()
        self.stop = np.zeros(shape, bool)
        self.red = np.zeros(shape, bool)
        self.next_compound = np.full(shape, -1, np.int64)
        for driver, lap, red, fitted in tyre_stops(race).select("driver", "lap", "red", "next_compound").iter_rows():
            i = self.at[driver]
            self.stop[i, lap], self.red[i, lap] = True, red
            self.next_compound[i, lap] = COMPOUNDS.index(fitted) if fitted in COMPOUNDS else -1
        self._track_sets()

    def _track_sets(self) -> None:
        """State before each lap, from the stops: age of the set, stops made, compounds used, and the compound fitted (-1: unknown)."""
        shape = self.time.shape
        self.age, self.made, self.used = np.zeros(shape, np.int64), np.zeros(shape, np.int64), np.zeros(shape, np.int64)
        self.fitted = np.full(shape, -1, np.int64)
        self.last = np.array([np.flatnonzero(r).max(initial=0) for r in self.run])
        for i in range(shape[0]):
            known = self.compound[i][self.compound[i] >= 0]
            current = int(known[0]) if len(known) else -1
            used, age, made = 0, 0, 0
            for lap in range(1, self.laps + 1):
                used |= 1 << current if current >= 0 else 0
                self.age[i, lap], self.made[i, lap], self.used[i, lap], self.fitted[i, lap] = age, made, used, current
                age += 1
                if self.stop[i, lap]:
                    made += not self.red[i, lap]
                    current = int(self.next_compound[i, lap])
                    age = 0

    def odd(self) -> NDArray[np.bool_]:
        """Stops on racing laps that are no strategy: damage, or the fastest lap."""
        lap = np.arange(self.laps + 1)[None]
        two_compounds = (self.used & (self.used - 1)) != 0
        damage = self.age + 1 <= DAMAGE_LAPS
        dash = (self.laps - lap <= DASH_LAPS) & two_compounds
        return self.stop & ~self.red & (self.status == GREEN) & (damage | dash)

    def stints(self) -> pl.DataFrame:
        """One row per stint, see `RaceDecisions`."""
        odd, found = self.odd(), []
        for i, driver in enumerate(self.drivers):
            first = True
            for lap in range(1, self.last[i] + 1):
                end = self.stop[i, lap]
                if not end and lap < self.last[i]:
                    continue
                how = "flag" if lap >= self.laps - 3 and driver not in self.retired else "out"
                if end:
                    how = "red" if self.red[i, lap] else "odd" if odd[i, lap] else "box" if self.status[i, lap] == GREEN else "slow"
                if self.fitted[i, lap] >= 0:
                    found.append((driver, int(self.fitted[i, lap]), int(self.age[i, lap]) + 1, first, how))
                first = False
        names = {"driver": pl.String, "compound": pl.Int64, "laps": pl.Int64, "first": pl.Boolean, "ended": pl.String}
        return pl.DataFrame(found, schema=names, orient="row")

    def laps_under_status(self) -> NDArray[np.int64]:
        """Consecutive laps before this one under the same neutralisation."""
        count = np.zeros(self.time.shape, np.int64)
        for lap in range(2, self.laps + 1):
            same = (self.status[:, lap] == self.status[:, lap - 1]) & (self.status[:, lap] != GREEN)
            count[:, lap] = np.where(same, count[:, lap - 1] + 1, 0)
        return count

    def stop_loss_s(self) -> float:
        """Median loss of a stop on a racing lap: in-lap and out-lap against the laps beside them."""
        losses = []
        for i, lap in zip(*np.nonzero(self.stop & ~self.red), strict=True):
            if 3 <= lap < self.laps - 2 and (self.status[i, lap - 2 : lap + 4] == GREEN).all():
                near = np.nanmedian(self.lap_s[i, [lap - 2, lap - 1, lap + 2, lap + 3]]) if self.last[i] > lap + 2 else np.nan
                losses.append(self.lap_s[i, lap] + self.lap_s[i, lap + 1] - 2 * near)
        good = np.array(losses)
        good = good[np.isfinite(good) & (good > 8) & (good < 45)]
        return float(np.median(good)) if len(good) >= 3 else USUAL_STOP_S


def _rows(race: _RaceLaps, season: int, round_number: int) -> pl.DataFrame:
    """The decisions of a race: state before the lap, surroundings at the line, and what was done."""
    loss_s, since, odd = race.stop_loss_s(), race.laps_under_status(), race.odd()
    parts = []
    for lap in range(2, race.laps):
        decided = race.run[:, lap] & (race.status[:, lap] != RED) & ~race.red[:, lap] & ~odd[:, lap]
        cars = np.flatnonzero(decided & (race.fitted[:, lap] >= 0))
        if len(cars) == 0:
            continue
        around = _surroundings(race, lap, loss_s)
        parts.append(
            pl.DataFrame(
                {
                    "driver": [race.drivers[i] for i in cars],
                    "grid": race.grid[cars],
                    "lap": np.full(len(cars), lap),
                    "laps_left": np.full(len(cars), race.laps - lap),
                    "compound": race.fitted[cars, lap],
                    "start": race.fitted[cars, 1],
                    "age": race.age[cars, lap],
                    "used": race.used[cars, lap],
                    "made": race.made[cars, lap],
                    "status": race.status[cars, lap],
                    "since": since[cars, lap],
                    **{name: values[cars] for name, values in around.items()},
                    "box": race.stop[cars, lap],
                    "fits": race.next_compound[cars, lap],
                }
            )
        )
    if not parts:
        return pl.DataFrame()
    return pl.concat(parts).with_columns(
        season=pl.lit(season), round=pl.lit(round_number), laps=pl.lit(race.laps), stop_loss_s=pl.lit(loss_s)
    )


def _surroundings(race: _RaceLaps, lap: int, loss_s: float) -> dict[str, Matrix]:
    """Gaps at the line before `lap`, s, and how many cars around have just stopped; arrays [cars].

    A car that stopped on the lap before counts as having lost the whole stop already, as in the compiled race, wherever the line is.
    """
    n, before = len(race.drivers), lap - 1
    stopped = race.stop[:, before] & ~race.red[:, before]
    time = np.where(race.run[:, lap], race.time[:, before], np.nan)
    if stopped.any() and before > 1:
        took = (race.time[:, before] - race.time[:, before - 1])[~stopped & np.isfinite(time)]
        usual = float(np.nanmedian(took)) if np.isfinite(took).any() else np.nan
        time = np.where(stopped & np.isfinite(time), race.time[:, before - 1] + usual + loss_s, time)
    order = [int(i) for i in np.argsort(time, kind="stable") if np.isfinite(time[i])]
    names = ("gap_ahead_s", "gap_behind_s", "ahead_stopped", "behind_stopped", "stopped", "mate_stopped")
    out = {name: np.zeros(n) for name in names}
    out["gap_ahead_s"][:] = out["gap_behind_s"][:] = FAR_S
    out["stopped"][:] = stopped.sum()
    for p, car in enumerate(order):
        if p > 0:
            out["gap_ahead_s"][car] = min(time[car] - time[order[p - 1]], FAR_S)
        if p + 1 < len(order):
            out["gap_behind_s"][car] = min(time[order[p + 1]] - time[car], FAR_S)
        gap = time - time[car] - loss_s  # below zero: was ahead before it stopped
        out["ahead_stopped"][car] = (stopped & (gap < 0) & (gap >= -UNDERCUT_S)).sum()
        out["behind_stopped"][car] = (stopped & (gap >= 0) & (gap < UNDERCUT_S)).sum()
        mates = (race.teams == race.teams[car]) & (np.arange(n) != car)
        out["mate_stopped"][car] = float(stopped[mates].any())
    return out
