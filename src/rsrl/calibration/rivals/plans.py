"""Rivals that drive plans: the plans to start a race with, and how teams on a plan react to a safety car."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.calibration.race.design import robust_sd
from rsrl.calibration.rivals import prior
from rsrl.calibration.rivals.features import numbers, usual_stint
from rsrl.calibration.rivals.stint_lengths import Outlook
from rsrl.season import COMPOUNDS, GREEN, SC, VSC, Figure, RivalPlan

Matrix = NDArray[np.float64]

MIN_SHARE: Final = 0.02  # of a starting compound; plans on a rarer one are left out
FIRST_LAPS: Final = 3  # of a neutralisation: a stop on one of them is a reaction to it
YOUNG_LAPS: Final = 5
MIN_REACTIONS: Final = 40
MOST_WINDOW: Final = 30


@dataclass(frozen=True)
class Reactions:
    """Spread of stops about the usual lap, as a share of the stint, and reactions to safety cars."""

    spread: Figure
    sc_window_laps: Figure
    sc_reaction: Figure
    vsc_window_laps: Figure
    vsc_reaction: Figure

    def jitter(self, stint_laps: float) -> Figure:
        """Spread in laps, for a usual first stint of `stint_laps`."""
        s = self.spread
        return Figure(min(s.value * stint_laps, 10.0), s.se * stint_laps, s.n, s.note)


def reaction_figures(races: Sequence[tuple[pl.DataFrame, Matrix]]) -> Reactions:
    """Figures of plans from the decisions and usual stints [2, 3] of races."""
    off, due, stopped, status = [], [], [], []
    for rows, stint_laps in races:
        left = usual_stint(rows, np.broadcast_to(stint_laps, (rows.height, 2, 3))) - (numbers(rows, "age") + 1)
        marked = rows.with_columns(due=pl.Series(left), life=pl.Series(left + numbers(rows, "age") + 1))
        off += [float(d / n) for d, n in marked.filter(pl.col("box") & (pl.col("status") == GREEN)).select("due", "life").iter_rows()]
        boxes = {(d, n) for d, n in marked.filter("box").select("driver", "lap").iter_rows()}
        begun = marked.filter((pl.col("status") != GREEN) & (pl.col("since") == 0) & (pl.col("age") >= YOUNG_LAPS))
        begun = begun.filter(pl.col("laps_left") > pl.col("due") + YOUNG_LAPS)
        for driver, lap, kind, laps_due in begun.select("driver", "lap", "status", "due").iter_rows():
            due.append(laps_due)
            status.append(kind)
            stopped.append(any((driver, lap + i) in boxes for i in range(FIRST_LAPS)))
    usual, weight = prior.SPREAD
    own = robust_sd(off) if off else 0.0
    spread = float(np.sqrt((len(off) * own**2 + weight * usual**2) / (len(off) + weight)))
    note = "spread of green stops about the usual stint, share of it"
    d, s, k = np.array(due), np.array(stopped, bool), np.array(status)
    sc, vsc = _window(d[k == SC], s[k == SC], "SC"), _window(d[k == VSC], s[k == VSC], "VSC")
    return Reactions(Figure(spread, spread / (2 * (len(off) + weight)) ** 0.5, len(off), note), *sc, *vsc)


def _window(due: Matrix, stopped: NDArray[np.bool_], name: str) -> tuple[Figure, Figure]:
    """Window and probability of a reaction: the step function of laps to the usual stop that fits best who stopped (maximum likelihood)."""
    n = len(due)
    if n < MIN_REACTIONS:
        return Figure(8.0, 4.0, n, f"assumed: too few {name} decisions"), Figure(0.5, 0.2, n, "assumed")
    windows = np.arange(1, MOST_WINDOW + 1)
    scores = np.array([_log_likelihood(stopped[due <= w]) + _log_likelihood(stopped[due > w]) for w in windows])
    best = int(windows[int(np.argmax(scores))])
    near = windows[scores > scores.max() - 2.0]
    inside = stopped[due <= best]
    chance = (float(inside.sum()) + 0.5) / (len(inside) + 1.0)
    note = (
        f"{name}: {int(inside.sum())} of {len(inside)} cars due within {best} laps stopped, {int(stopped[due > best].sum())} of the others"
    )
    se = (chance * (1 - chance) / max(len(inside) / 10, 1)) ** 0.5
    return Figure(float(best), float(np.ptp(near)) / 4 + 0.5, n, note), Figure(chance, se, len(inside), note)


def _log_likelihood(stopped: NDArray[np.bool_]) -> float:
    n, k = len(stopped), float(stopped.sum())
    p = (k + 0.5) / (n + 1.0)
    return float(k * np.log(p) + (n - k) * np.log(1 - p))


def intended_plans(outlook: Outlook, laps: int, sets: Mapping[str, int], max_laps_per_set: int, min_sets: int) -> tuple[RivalPlan, ...]:
    """Plans with weights: for each starting compound, the two numbers of stops next to the expected one."""
    fewest = max(min_sets - 1, -(-laps // max_laps_per_set) - 1 if max_laps_per_set else 1)
    most = sum(sets.values()) - 1  # a fresh set for every stint
    low = min(max(int(outlook.stops), fewest), most)
    more = min(max(outlook.stops - low, 0.0), 1.0) if low < most else 0.0
    plans = []
    for start in range(3):
        if outlook.starts[start] < MIN_SHARE or sets[COMPOUNDS[start]] < 1:
            continue
        for stops, share in ((low, 1 - more), (low + 1, more)):
            compounds = _compounds(start, stops, outlook, sets)
            if share > 0 and compounds:
                text = COMPOUNDS[start] + "".join(
                    f"-{COMPOUNDS[c]}@{lap}"
                    for c, lap in zip(compounds[1:], _laps(compounds, outlook, laps, max_laps_per_set), strict=True)
                )
                plans.append(RivalPlan(text, round(float(outlook.starts[start]) * share * 100, 3)))
    return tuple(sorted(plans, key=lambda p: (-p.weight, p.plan)))


def _compounds(start: int, stops: int, outlook: Outlook, sets: Mapping[str, int]) -> tuple[int, ...]:
    """The most usual compounds that the sets allow, two different ones at least; empty where the sets do not suffice."""
    left = [sets[c] for c in COMPOUNDS]
    left[start] -= 1
    chosen = [start]
    for i in range(stops):
        must = i == stops - 1 and len(set(chosen)) == 1
        can = [c for c in range(3) if left[c] > 0 and not (must and c == start)]
        if not can:
            return ()
        chosen.append(max(can, key=lambda c: outlook.fitted[c] / (1 + 2 * (c == chosen[-1] == start))))
        left[chosen[-1]] -= 1
    return tuple(chosen)


def _laps(compounds: tuple[int, ...], outlook: Outlook, laps: int, limit: int) -> list[int]:
    """Stop laps: the first stint of usual length, the rest shared out by usual stints; no stint beyond the limit of laps a set."""
    stint_laps = np.array([outlook.stint_laps[1, c] for c in compounds])
    stint_laps[0] = outlook.stint_laps[0, compounds[0]]
    shares = stint_laps / stint_laps.sum()
    first = min(stint_laps[0], laps * max(0.75, shares[0]))
    rest = (laps - first) * stint_laps[1:] / stint_laps[1:].sum()
    edges = np.cumsum(np.array([first, *rest])[:-1])
    if limit:
        even = laps / len(compounds) * np.arange(1, len(compounds))
        spans = np.diff(np.array([0.0, *edges, laps]))
        edges = even if spans.max() > limit - 1 else edges
    found = [max(round(float(e)), 1) for e in edges]
    for i, _ in enumerate(pairwise(found), 1):
        found[i] = max(found[i], found[i - 1] + 1)
    return [min(lap, laps - len(found) + i) for i, lap in enumerate(found)]
