"""The stops of one race: what they cost under green, in-lap and out-lap apart, slow ones by team, double stacks, cost under SC and VSC."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.race.design import Array, robust_sd
from rsrl.calibration.race.pace_and_tyres import PaceModel
from rsrl.calibration.race.stops import green_stops, stop_table
from rsrl.laps import DRY
from rsrl.season import COMPOUNDS, SC, VSC, Figure

SLOW: Final = 1.12
CLEAR_S: Final = 1.5  # an out-lap that ends closer to another car was held up
MIN_STOPS: Final = 6  # for a race's quickest stop to mean something
LONE_S: Final = 1.5  # quicker than every other by so much: a fault of the record, as in five races of 2018-2024
MIN_COMPOUND_STOPS: Final = 3
MIN_LANE_S, MAX_LANE_S = 10.0, 45.0
REPAIR_S: Final = 15.0  # beyond the quickest stop: repairs and penalties
LATE_LAPS: Final = 8  # from the flag: stops for the fastest lap are not hurried
STACK_GAP_S: Final = 8.0  # a team's second car this close behind its first at the pit entry has to wait


@dataclass(frozen=True)
class PitAnalysis:
    """Pit stops of one race."""

    cost_s: dict[str, Figure]
    """By compound fitted: in-lap and out-lap beyond the pace model, less the stop's excess over the race's quickest."""

    in_share: Figure | None  # of that cost, what falls on the in-lap
    excess_s: tuple[tuple[str, float], ...]  # team, pit-lane time beyond the race's quickest, green stops
    ratios_vsc: tuple[float, ...]  # cost over green cost, one median per lap on which cars stopped
    ratios_sc: tuple[float, ...]
    waits_s: tuple[float, ...]
    """Double stacks: from the first car's entry to the second car's service, without the first stop's excess."""


def analyse_pit(race: pl.DataFrame, model: PaceModel) -> PitAnalysis:
    """Stops of one race; figures that too few stops support are left empty."""
    stops = stop_table(race).filter(pl.col("compound").is_in(list(DRY)) & pl.col("compound_out").is_in(list(DRY)))
    green = green_stops(stops)
    quickest = _quickest(green["lane_s"].drop_nulls())
    excess: tuple[tuple[str, float], ...] = ()
    cost: dict[str, Figure] = {}
    share = None
    if quickest is not None:
        lanes = green.drop_nulls("lane_s").with_columns(excess=pl.col("lane_s") - quickest)
        lanes = lanes.filter(pl.col("excess").is_between(0.0, REPAIR_S, closed="left"))
        excess = tuple(lanes.select("team", "excess").iter_rows())
        cost, share = _cost(lanes, model)
    return PitAnalysis(cost, share, excess, _ratios(stops, green, VSC), _ratios(stops, green, SC), _waits(race, quickest))


def _quickest(lanes_s: pl.Series) -> float | None:
    """Pit-lane time of the quickest stop; None with too few of them."""
    if len(lanes_s) < MIN_STOPS:
        return None
    first, second = (float(v) for v in lanes_s.sort()[:2])
    return second if second - first > LONE_S else first


def lane_time(race: pl.DataFrame) -> Figure | None:
    """Pit-lane time of a quick stop, entry to exit: the speed limit is the same in the rain and behind the safety car."""
    lanes = stop_table(race).filter(pl.col("lane_s").is_between(MIN_LANE_S, MAX_LANE_S))["lane_s"].sort()
    if len(lanes) < MIN_STOPS:
        return None
    quick = lanes[: max(len(lanes) // 2, MIN_STOPS)].to_numpy()
    return Figure(float(np.median(quick)), float(1.25 * max(np.std(quick), 0.2) / np.sqrt(len(quick))), len(lanes))


def _cost(stops: pl.DataFrame, model: PaceModel) -> tuple[dict[str, Figure], Figure | None]:
    """Cost by compound taken on, and the in-lap's share; out-laps in clear air only, where there are enough of them."""
    stops = stops.filter(pl.col("lap") <= model.race_laps - LATE_LAPS)
    clear = stops.filter(pl.col("out_gap_s").fill_null(99.0) > CLEAR_S)
    stops = clear if clear.height >= MIN_STOPS else stops
    if stops.height < MIN_STOPS:
        return {}, None
    before, after = _without_stop(stops, model)
    in_extra = stops["in_s"].to_numpy() - before
    extra = in_extra + stops["out_s"].to_numpy() - after - stops["excess"].to_numpy()
    sd = max(robust_sd(extra), 0.15)
    taken = stops["compound_out"].to_numpy()
    cost = {}
    for letter in COMPOUNDS:
        own = extra[taken == letter]
        if len(own) >= MIN_COMPOUND_STOPS:
            cost[letter] = Figure(float(np.median(own)), float(1.25 * sd / np.sqrt(len(own))), len(own))
    shares = in_extra / np.maximum(extra + stops["excess"].to_numpy(), 5.0)
    se = 1.25 * max(robust_sd(shares), 0.01) / np.sqrt(len(shares))
    return cost, Figure(float(np.median(shares)), float(se), len(shares))


def _without_stop(stops: pl.DataFrame, model: PaceModel) -> tuple[Array, Array]:
    """The in-lap on the old tyre in its traffic and a free out-lap on the new one at age zero, by the pace model."""
    before = model.predict(stops) + model.traffic(stops)
    after = model.predict(stops.with_columns(pl.col("compound_out").alias("compound"), lap=pl.col("lap") + 1, age_laps=pl.lit(0)))
    return before, after


def _ratios(stops: pl.DataFrame, green: pl.DataFrame, status: int) -> tuple[float, ...]:
    """Loss under a neutralisation over the race's green loss: one median per lap on which cars stopped, both laps slow."""
    if green.height < 4:
        return ()
    normal = float(green["loss_s"].median())  # type: ignore[arg-type]
    slow = stops.filter(
        (pl.col("status") == status)
        & (pl.col("slow_in") > SLOW)
        & (pl.col("slow_out") > SLOW)
        & (pl.col("status_out") == status)
        & (pl.col("lane_s") < 40.0)
    )
    if status == SC:  # later the queue has closed up and a stop costs what the queue leaves
        slow = slow.filter(pl.col("lap") == pl.col("lap").min())
    per_lap = slow.group_by("lap", maintain_order=True).agg(pl.col("loss_s").median())
    return tuple(float(v) / normal for v in per_lap["loss_s"].drop_nulls())


def _waits(race: pl.DataFrame, quickest: float | None) -> tuple[float, ...]:
    """Service intervals of double stacks.

    The second car's pit-lane time beyond the quickest, plus its distance behind the first, less the first's excess.
    """
    if quickest is None:
        return ()
    entries = stop_table(race).drop_nulls(["lane_s", "pit_in_s"]).sort("team", "lap", "pit_in_s")
    waits = []
    for _, pair in entries.group_by("team", "lap", maintain_order=True):
        if pair.height != 2:
            continue
        behind = float(pair["pit_in_s"][1] - pair["pit_in_s"][0])
        first, second = (float(v) - quickest for v in pair["lane_s"])
        if behind < STACK_GAP_S and first < REPAIR_S and 1.0 < second < REPAIR_S:
            waits.append(second + behind - first)
    return tuple(waits)
