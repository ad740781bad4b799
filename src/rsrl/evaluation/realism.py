"""Would someone who watched the race recognise the simulated one? The same quantities of both, side by side."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord
from rsrl.simulator import RaceResults, Trace

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True)
class RealRace:
    """One real race by car index of the record; a car that is missing or stopped early has NaN times from there on."""

    race_time_s: NDArray[np.float64]  # [laps, cars] from the start to the end of each lap
    stops: NDArray[np.int64]  # [cars]
    laps_done: NDArray[np.int64]  # [cars]
    place: NDArray[np.int64]  # [cars] rank by laps done, then time: on the road, before penalties
    slow_laps: tuple[int, int]  # laps behind the safety car, laps of virtual safety car
    stop_loss_s: float  # median over green stops of in-lap plus out-lap against twice the car's median green lap


def real_race(table: "pl.DataFrame", record: RaceRecord) -> RealRace:
    """Take a record's race out of the lap table. Raises RsrlError where it is not there."""
    import polars as pl

    from rsrl.laps import neutralised_laps

    race = table.filter((pl.col("season") == record.season) & (pl.col("round") == record.round))
    if race.is_empty():
        raise RsrlError(f"the laps given have no {record.event} {record.season}; give the folder with its season's file")
    begin = race.filter(pl.col("lap") == 1).select((pl.col("session_time_s") - pl.col("lap_time_s")).min()).item()
    times = np.full((record.laps, len(record.cars)), np.nan)
    stops = np.zeros(len(record.cars), np.int64)
    losses: list[float] = []
    for i, car in enumerate(record.cars):
        laps = race.filter(pl.col("driver") == car.driver).sort("lap")
        index = laps["lap"].to_numpy() - 1
        inside = index < record.laps
        times[index[inside], i] = laps["session_time_s"].to_numpy()[inside] - begin
        stops[i] = int(laps["pit_in_s"].is_not_null().sum())
        losses.extend(_stop_losses(laps))
    done = np.isfinite(times).sum(axis=0)
    last = np.nanmax(np.where(np.isfinite(times), times, 0.0), axis=0)
    order = np.lexsort((last, -done))
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(1, len(order) + 1)
    slow = neutralised_laps(race)["status"].to_list()
    return RealRace(times, stops, done, place, (slow.count(2), slow.count(1)), float(np.median(losses)))


def _stop_losses(laps: "pl.DataFrame") -> list[float]:
    """Loss of each of a car's stops with both laps around it under green."""
    time = laps["lap_time_s"].to_numpy()
    green = (laps["track_status"].fill_null("").str.contains("[4567]").not_()).to_numpy()
    pit_in = laps["pit_in_s"].is_not_null().to_numpy()
    racing = green & ~pit_in & laps["pit_out_s"].is_null().to_numpy()
    usual = float(np.nanmedian(time[racing])) if racing.any() else np.nan
    pairs = [(i, i + 1) for i in np.flatnonzero(pit_in[:-1]) if green[i] and green[i + 1]]
    return [float(time[a] + time[b] - 2 * usual) for a, b in pairs if np.isfinite(time[a] + time[b])]


def compare(record: RaceRecord, real: RealRace, results: RaceResults, trace: Trace) -> list[tuple[str, str, str]]:
    """Rows (quantity, real, simulated: median and 5 to 95 % range) of the whole race.

    Times are of simulated races that had neither SC nor VSC, since one lap behind the safety car costs a minute; the row says so.
    """
    cars = len(record.cars)
    quiet = results.slow_laps.sum(axis=1) == 0
    finish = np.where(results.retired[:, :cars], np.nan, results.race_time_s[:, :cars])
    winner = np.nanmin(finish, axis=1)
    ranked = np.sort(finish, axis=1)
    full = real.laps_done == record.laps
    real_finish = np.sort(real.race_time_s[-1][full])
    n = min(10, len(real_finish))
    real_lapped = int((~full & (real.laps_done >= record.laps - 3)).sum())
    real_out = int((real.laps_done < record.laps - 3).sum())
    lapped = (finish - winner[:, None] > record.track.base_lap_s.value).sum(axis=1)
    kept = ~results.retired[:, :cars]
    stops = (results.stops[:, :cars] * kept).sum(axis=1) / kept.sum(axis=1)
    behind = [f"{real_finish[place - 1] - real_finish[0]:.0f}" for place in (2, n)]
    return [
        ("winner's time, s (races without SC or VSC)", f"{real_finish[0]:.0f}", _spread(winner[quiet])),
        ("P2 behind the winner, s (the same races)", behind[0], _spread((ranked[:, 1] - winner)[quiet])),
        (f"P{n} behind the winner, s (the same races)", behind[1], _spread((ranked[:, n - 1] - winner)[quiet])),
        ("cars a lap or more down at the flag", str(real_lapped), _spread(lapped[quiet])),
        ("stops of a car that finished", f"{real.stops[full].mean():.2f}", _spread(stops, 2)),
        ("cost of a green stop with cold tyres, s", f"{real.stop_loss_s:.1f}", f"{_stop_cost(record, trace):.1f}"),
        ("cars out", str(real_out), _spread(results.retired[:, :cars].sum(axis=1))),
        ("laps behind the safety car", str(real.slow_laps[0]), _spread(results.slow_laps[:, 0])),
        ("laps of virtual safety car", str(real.slow_laps[1]), _spread(results.slow_laps[:, 1])),
    ]


def _spread(values: NDArray[np.generic], decimals: int = 0) -> str:
    low, middle, high = (f"{q:.{decimals}f}" for q in np.nanpercentile(values.astype(float), (5, 50, 95)))
    return f"{middle} ({low} to {high})"


def _stop_cost(record: RaceRecord, trace: Trace) -> float:
    """Median over simulated green stops of stop lap plus next lap against twice the car's median lap, as for the real race."""
    cars = len(record.cars)
    times, stopped = trace.lap_time_s[:, :, :cars], trace.stopped[:, :, :cars]
    green = (trace.track_status == 0)[:, :, None] & trace.running[:, :, :cars]
    out_lap = np.zeros_like(stopped)
    out_lap[:, 1:] = stopped[:, :-1]
    racing = green & ~stopped & ~out_lap
    racing[:, 0] = False
    usual = np.ma.median(np.ma.array(times, mask=~racing), axis=1).filled(np.nan)  # a car out on lap 1 has no racing lap
    both = stopped[:, :-1] & green[:, :-1] & green[:, 1:] & trace.running[:, 1:, :cars]
    cost = times[:, :-1] + times[:, 1:] - 2 * usual[:, None, :]
    return float(np.median(cost[both]))


def plot_traces(record: RaceRecord, real: RealRace, trace: Trace, path: Path) -> int:
    """Race trace, real beside simulated: time to a car that laps steadily at the winner's average. Returns the race number drawn.

    The simulated race is the first without safety car; nothing else was chosen.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    quiet = np.flatnonzero((trace.track_status > 0).sum(axis=1) == 0)
    if not len(quiet):
        raise RsrlError("no traced race ran without a safety car; trace more races")
    shown = int(quiet[0])
    cars = len(record.cars)
    simulated = np.where(trace.running[shown, :, :cars], trace.race_time_s[shown, :, :cars], np.nan)
    teams = sorted({car.team for car in record.cars})
    colours = plt.get_cmap("tab10")
    figure, axes = plt.subplots(1, 2, figsize=(15, 7.5), sharey=True)
    titles = (f"{record.event} {record.season}, as it was", f"simulated race {shown}")
    for axis, times, title in zip(axes, (real.race_time_s, simulated), titles, strict=True):
        pace = np.nanmin(times[-1]) / record.laps
        laps = np.arange(1, record.laps + 1)
        seen: set[str] = set()
        for i, car in enumerate(record.cars):
            gap = times[:, i] - pace * laps
            line = "--" if car.team in seen else "-"
            seen.add(car.team)
            axis.plot(laps, gap, line, color=colours(teams.index(car.team)), linewidth=1.2)
            last = np.flatnonzero(np.isfinite(gap))
            if len(last):
                axis.annotate(car.driver, (laps[last[-1]] + 0.4, gap[last[-1]]), fontsize=7, va="center", annotation_clip=True)
        axis.set_title(title)
        axis.set_xlabel("lap")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("behind a steady car at the winner's average, s")
    axes[0].set_ylim(130, -30)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return shown
