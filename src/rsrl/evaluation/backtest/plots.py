"""Figures of a backtest: calibration of stated chances, predicted against official positions, stops, errors by race."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.drawing import SERIES_COLOURS, new_figure, save_figure
from rsrl.statistics import proportion_interval

Races = Sequence[Mapping[str, Any]]
"""`races` of the JSON that `rsrl backtest` writes."""

BLUE, ORANGE, GREY, GREEN = SERIES_COLOURS[:4]
BINS: Final = (0.0, 0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0)


def reliability(predicted: NDArray[np.float64], came: NDArray[np.bool_]) -> list[tuple[float, float, float, float, int]]:
    """Of each bin of stated chances: mean chance, share that came true, its 95 % Wilson interval, and how many."""
    rows = []
    for low, high in zip(BINS, BINS[1:], strict=False):
        inside = (predicted >= low) & ((predicted < high) | (high == 1.0))
        n = int(inside.sum())
        if n:
            share = float(came[inside].mean())
            rows.append((float(predicted[inside].mean()), share, *proportion_interval(share, n), n))
    return rows


def plot_reliability(races: Races, title: str, path: Path) -> None:
    """Stated chance of points and of winning against how often it came true."""
    cars = [car for race in races for car in race["cars"]]
    position = np.array([c["position"] for c in cars])
    figure, axes = new_figure(10.0, 4.8, 2)
    for axis, key, came, name in zip(axes, ("p_points", "p_win"), (position <= 10, position == 1), ("points", "a win"), strict=True):
        rows = np.array(reliability(np.array([c[key] for c in cars]), came))
        axis.plot([0, 1], [0, 1], color=GREY, lw=1, ls="--")
        axis.errorbar(rows[:, 0], rows[:, 1], yerr=np.abs(rows[:, 2:4].T - rows[:, 1]), fmt="o-", color=BLUE, capsize=3)
        for chance, share, _, _, n in rows:
            axis.annotate(f"{n:.0f}", (chance, share), textcoords="offset points", xytext=(6, -10), fontsize=8, color=GREY)
        axis.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel=f"stated chance of {name}", ylabel="share that came true")
    save_figure(figure, title, path)


def plot_positions(races: Races, title: str, path: Path) -> None:
    """Mean simulated against official position of every car."""
    cars = [car for race in races for car in race["cars"]]
    predicted, position = np.array([c["predicted"] for c in cars]), np.array([c["position"] for c in cars])
    figure, (axis,) = new_figure(6.4, 6.0)
    jitter = np.random.default_rng(0).uniform(-0.25, 0.25, len(cars))
    last = int(position.max())
    axis.plot([1, last], [1, last], color=GREY, lw=1, ls="--")
    axis.scatter(predicted, position + jitter, s=12, color=BLUE, alpha=0.5, lw=0)
    edges = np.arange(1, last + 1, 2)
    middles = [(predicted[m].mean(), position[m].mean()) for a in edges if (m := (predicted >= a) & (predicted < a + 2)).sum() > 4]
    axis.plot(*np.array(middles).T, "o-", color=ORANGE, label="mean by predicted position")
    ticks = range(1, last + 1, 3)
    axis.set(xlabel="predicted: mean simulated position", ylabel="official position", xticks=ticks, yticks=ticks)
    axis.legend(frameon=False)
    save_figure(figure, title, path)


def plot_stops(races: Races, title: str, path: Path) -> None:
    """Stops and lap of the first stop by race: mean of the field, predicted and real."""
    names = [r["race"].rsplit("-", 1)[0] for r in races]
    figure, axes = new_figure(12.0, 5.6, 2)
    for axis, real, said, label in zip(
        axes, ("stops", "first_stop"), ("stops_predicted", "first_stop_predicted"), ("stops of a classified car", "lap of the first stop"),
        strict=True,
    ):  # fmt: skip
        y = np.arange(len(names))[::-1]
        for race, at in zip(races, y, strict=True):
            pairs = np.array([(c[real], c[said]) for c in race["cars"] if c[real] is not None and c[said] is not None], float)
            if len(pairs):
                axis.plot(pairs.mean(axis=0), [at, at], color=GREY, lw=1)
                axis.plot(pairs[:, 0].mean(), at, "o", color=ORANGE)
                axis.plot(pairs[:, 1].mean(), at, "D", color=BLUE, ms=5)
        axis.set_yticks(y, names, fontsize=8)
        axis.set_xlabel(label)
    axes[0].plot([], [], "o", color=ORANGE, label="real")
    axes[0].plot([], [], "D", color=BLUE, label="predicted")
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    save_figure(figure, title, path)


def plot_errors(modes: Mapping[str, Races], title: str, path: Path) -> None:
    """Mean error in position by race for each mode, and of the grid."""
    first = next(iter(modes.values()))
    order = np.argsort([r["mae_position"] for r in first])
    names = [first[i]["race"].rsplit("-", 1)[0] for i in order]
    figure, (axis,) = new_figure(9.0, 6.0)
    y = np.arange(len(names))
    for (mode, races), colour, mark in zip(modes.items(), (BLUE, GREEN, ORANGE), "Dos", strict=False):
        axis.plot([races[i]["mae_position"] for i in order], y, mark, color=colour, label=mode)
    axis.plot([first[i]["grid"]["mae_position"] for i in order], y, "|", color=GREY, ms=14, mew=2, label="grid")
    axis.set_yticks(y, names, fontsize=8)
    axis.set_xlabel("mean error, places a car")
    axis.legend(frameon=False)
    save_figure(figure, title, path)
