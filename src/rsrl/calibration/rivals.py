"""How teams called this Grand Prix: the plans they ran, how far stops spread, what they did under a safety car, sets of tyres."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.facts import RaceFacts
from rsrl.calibration.incidents import deployments
from rsrl.errors import RsrlError
from rsrl.laps import CAR, DRY, RACE, stints, with_status
from rsrl.season import COMPOUNDS, SC, VSC, Figure, RivalFigures, RivalPlan

OTHER_SEASON_WEIGHT: Final = 0.25  # a plan of another season's race against one of the season described
SHORT_STINT_LAPS: Final = 5  # shorter ones end in damage; a last stint this short is a dash for the fastest lap
PLANNED_SHARE: Final = 0.75  # of the usual stint: a stop under SC or VSC with that age was due anyway
STRETCH_LAPS: Final = 3  # how far past the longest stint seen a stretched one may go
MAX_PLAN_STOPS: Final = 4
JITTER_PRIOR_LAPS: Final = 1.5
MIN_SETS: Final = {"S": 2, "M": 1, "H": 2}
MAX_SETS: Final = {"S": 8, "M": 3, "H": 2}  # the regulation's allotment for a weekend
LAST_REACTION_LAPS: Final = 3  # a stop so many laps from the start of a neutralisation is a reaction to it


@dataclass(frozen=True)
class _Run:
    """One car's race as it was called: stints as (letter, last lap), stops marked as forced."""

    season: int
    letters: tuple[str, ...]
    last_laps: tuple[int, ...]


def fit_rivals(
    table: pl.DataFrame, facts: Mapping[tuple[int, int], RaceFacts], season: int, event_rounds: list[tuple[int, int]], sets: dict[str, int]
) -> RivalFigures:
    """Plans of this Grand Prix and the reactions of all races.

    Args:
        table: lap table of every dry race of the seasons.
        facts: distance and retirements by (season, round).
        season: the season described; other seasons' plans weigh `OTHER_SEASON_WEIGHT`.
        event_rounds: (season, round) of this Grand Prix.
        sets: sets of each compound a car has: a plan that needs more is left out.

    Raises:
        RsrlError: no plan is left.
    """
    distance = facts[next((s, r) for s, r in event_rounds if s == season)].laps
    counted: dict[str, float] = {}
    for s, r in event_rounds:
        for plan in race_plans(table, facts[(s, r)], s, r):
            text = _text(plan, distance / facts[(s, r)].laps, distance, sets)
            if text:
                counted[text] = counted.get(text, 0.0) + (1.0 if s == season else OTHER_SEASON_WEIGHT)
    if not counted:
        raise RsrlError(f"no car of season {season} ran a plan of two compounds to the flag; there is nothing for rivals to do")
    sc_window, sc_chance = _reaction(table, SC)
    vsc_window, vsc_chance = _reaction(table, VSC)
    return RivalFigures(
        plans=tuple(RivalPlan(p, w) for p, w in sorted(counted.items(), key=lambda item: (-item[1], item[0]))),
        jitter_sd_laps=_jitter(table, facts, season, event_rounds),
        sc_window_laps=sc_window,
        sc_reaction=sc_chance,
        vsc_window_laps=vsc_window,
        vsc_reaction=vsc_chance,
    )


def race_plans(table: pl.DataFrame, facts: RaceFacts, season: int, round_number: int) -> list[_Run]:
    """The plans of cars that reached the flag, stops forced by a neutralisation undone where the tyres lasted without."""
    race = table.filter((pl.col("season") == season) & (pl.col("round") == round_number))
    runs = stints(race).filter(~pl.col("driver").is_in(list(facts.retired)))
    slow = {(d, lap) for d, lap in with_status(race).filter(pl.col("status").is_in([VSC, SC])).select("driver", "lap").iter_rows()}
    ended = runs.filter(pl.col("last_lap") < pl.col("last_lap").max().over(*CAR))
    usual = {c: float(n) for c, n in ended.group_by("compound").agg(pl.col("laps").median()).iter_rows()}
    longest = {c: int(n) for c, n in runs.group_by("compound").agg(pl.col("laps").max()).iter_rows()}
    plans = []
    for (driver,), car in runs.sort("first_lap").group_by("driver", maintain_order=True):
        rows = list(car.select("compound", "last_lap", "laps").iter_rows())
        if any(c not in DRY for c, _, _ in rows):
            continue
        if len(rows) > 1 and rows[-1][2] <= SHORT_STINT_LAPS:
            rows = [*rows[:-2], (rows[-2][0], rows[-1][1], rows[-2][2] + rows[-1][2])]
        if min(n for _, _, n in rows) <= SHORT_STINT_LAPS:
            continue
        rows = _undo_forced(rows, str(driver), slow, usual, longest)
        if 1 <= len(rows) - 1 <= MAX_PLAN_STOPS and len({c for c, _, _ in rows}) > 1:
            plans.append(_Run(season, tuple(c for c, _, _ in rows), tuple(last for _, last, _ in rows)))
    return plans


_Rows = list[tuple[str, int, int]]


def _undo_forced(rows: _Rows, driver: str, slow: set[tuple[str, int]], usual: dict[str, float], longest: dict[str, int]) -> _Rows:
    """Take out the last stop made under SC or VSC on tyres far from due, if they could have lasted to the next stop."""
    for i in range(len(rows) - 2, -1, -1):
        letter, last, laps = rows[i]
        joined = laps + rows[i + 1][2]
        if (driver, last) in slow and laps < PLANNED_SHARE * usual.get(letter, 1.0) and joined <= longest[letter] + STRETCH_LAPS:
            return [*rows[:i], (letter, rows[i + 1][1], joined), *rows[i + 2 :]]
    return rows


def _text(run: _Run, stretch: float, distance: int, sets: dict[str, int]) -> str | None:
    """`S-H@14-S@36`, stops scaled to this distance; None where it needs sets a car has not."""
    if any(run.letters.count(c) > sets[c] for c in COMPOUNDS):
        return None
    laps = [min(round(lap * stretch), distance - 1) for lap in run.last_laps[:-1]]
    return run.letters[0] + "".join(f"-{c}@{lap}" for c, lap in zip(run.letters[1:], laps, strict=True))


def sets_used(table: pl.DataFrame, season: int, round_number: int) -> dict[str, int]:
    """Most sets of each compound any car used in the race, within `MIN_SETS` and `MAX_SETS`.

    Stints of `SHORT_STINT_LAPS` or less do not count: after those a car often goes on with the same set.
    """
    race = table.filter((pl.col("season") == season) & (pl.col("round") == round_number))
    counts = (
        stints(race)
        .filter(pl.col("laps") > SHORT_STINT_LAPS)
        .group_by("driver", "compound")
        .len()
        .group_by("compound")
        .agg(pl.col("len").max())
    )
    most = {c: int(n) for c, n in counts.iter_rows() if c is not None}
    return {c: min(max(MIN_SETS[c], most.get(c, 0)), MAX_SETS[c]) for c in COMPOUNDS}


def _jitter(table: pl.DataFrame, facts: Mapping[tuple[int, int], RaceFacts], season: int, event_rounds: list[tuple[int, int]]) -> Figure:
    """Spread of the lap of a stop about its plan: half of the spread between cars that ran the same compounds in the same order.

    Half, because the plans already stand on the laps that the cars stopped on.
    """
    spreads: list[tuple[float, int]] = []
    for s, r in event_rounds:
        groups: dict[tuple[str, ...], list[tuple[int, ...]]] = {}
        for run in race_plans(table, facts[(s, r)], s, r):
            groups.setdefault(run.letters, []).append(run.last_laps[:-1])
        for laps in groups.values():
            if len(laps) > 1:
                spreads += [(float(v), len(laps) - 1) for v in np.var(np.array(laps, dtype=float), axis=0, ddof=1)]
    n = sum(k for _, k in spreads)
    between = sum(v * k for v, k in spreads)
    value = np.sqrt((between / 4 + 4 * JITTER_PRIOR_LAPS**2) / (n + 4))
    note = "half the spread between cars on the same sequence of compounds, with a prior of 1.5 laps worth 4 cars"
    return Figure(float(value), float(value / np.sqrt(2 * (n + 4))), n, note)


def reactions(table: pl.DataFrame, status: int) -> pl.DataFrame:
    """Every car at every deployment: laps to its usual stop, `due_laps`, and whether it `stopped` in the first laps of it.

    The usual stop is the stint's compound at the race's median age at a green-flag stop; cars with less than `SHORT_STINT_LAPS`
    on their tyres, or with their last stop behind them by then (no later stop and due after the flag), are left out.
    """
    runs = stints(table).with_columns(ended=pl.col("last_lap") < pl.col("last_lap").max().over(*CAR))
    usual = (
        runs.filter(pl.col("ended") & (pl.col("laps") > SHORT_STINT_LAPS)).group_by(*RACE, "compound").agg(usual=pl.col("laps").median())
    )
    race_end = table.group_by(*RACE).agg(distance=pl.col("lap").max())
    called = deployments(table).filter((pl.col("status") == status) & (pl.col("lap") > 3)).select(*RACE, pl.col("lap").alias("at"))
    return (
        runs.join(called, on=RACE)
        .filter((pl.col("first_lap") <= pl.col("at")) & (pl.col("last_lap") >= pl.col("at")))
        .join(usual, on=[*RACE, "compound"])
        .join(race_end, on=RACE)
        .with_columns(age=pl.col("at") - pl.col("first_lap"), due_laps=pl.col("usual") - (pl.col("at") - pl.col("first_lap") + 1))
        .filter((pl.col("age") >= SHORT_STINT_LAPS) & (pl.col("at") + pl.col("due_laps") < pl.col("distance") - SHORT_STINT_LAPS))
        .with_columns(stopped=pl.col("ended") & (pl.col("last_lap") < pl.col("at") + LAST_REACTION_LAPS))
        .select(*CAR, "at", "age", "due_laps", "stopped")
    )


def _reaction(table: pl.DataFrame, status: int) -> tuple[Figure, Figure]:
    """Window and probability: the step function of laps to the usual stop that best tells who stopped (maximum likelihood)."""
    seen = reactions(table, status)
    name = "SC" if status == SC else "VSC"
    if seen.height < 40:
        return Figure(8.0, 4.0, seen.height, f"assumed: too few {name} calls"), Figure(0.5, 0.2, seen.height, "assumed")
    due, stopped = seen["due_laps"].to_numpy(), seen["stopped"].to_numpy()
    windows = np.arange(1, 31)
    scores = np.array([_log_likelihood(stopped[due <= w]) + _log_likelihood(stopped[due > w]) for w in windows])
    best = int(windows[int(np.argmax(scores))])
    near = windows[scores > scores.max() - 2.0]
    inside = stopped[due <= best]
    chance = (inside.sum() + 0.5) / (len(inside) + 1.0)
    outside = stopped[due > best]
    others = f"{int(outside.sum())} of {len(outside)} others"
    note = f"{name}: {int(inside.sum())} of {len(inside)} cars due within {best} laps stopped, {others}; all races given"
    events = max(seen.select(*RACE, "at").unique().height, 1)
    return (
        Figure(float(best), float(np.ptp(near) / 4 + 0.5), seen.height, note),
        Figure(float(chance), float(np.sqrt(chance * (1 - chance) / max(min(len(inside), 3 * events), 1))), len(inside), note),
    )


def _log_likelihood(stopped: np.ndarray) -> float:
    """Of a group of cars under one common probability of stopping."""
    n, k = len(stopped), float(stopped.sum())
    p = (k + 0.5) / (n + 1.0)
    return float(k * np.log(p) + (n - k) * np.log(1 - p))
