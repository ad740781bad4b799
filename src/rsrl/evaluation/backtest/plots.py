"""Pictures of a backtest: are stated chances kept, who was misjudged, where and how the errors lie, the races as traces."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.errors import RsrlError
from rsrl.statistics import proportion_interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Races = Sequence[Mapping[str, Any]]
"""`races` of the JSON that `rsrl backtest` writes."""

BLUE, ORANGE, GREY, GREEN = "#0b5fa5", "#e07b00", "#9a9a9a", "#3a9a5b"
BINS: Final = (0.0, 0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0)
DPI: Final = 130


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
    figure, axes = _blank(2, 10.0, 4.8)
    for axis, key, came, name in zip(axes, ("p_points", "p_win"), (position <= 10, position == 1), ("points", "a win"), strict=True):
        rows = np.array(reliability(np.array([c[key] for c in cars]), came))
        axis.plot([0, 1], [0, 1], color=GREY, lw=1, ls="--")
        axis.errorbar(rows[:, 0], rows[:, 1], yerr=np.abs(rows[:, 2:4].T - rows[:, 1]), fmt="o-", color=BLUE, capsize=3)
        for chance, share, _, _, n in rows:
            axis.annotate(f"{n:.0f}", (chance, share), textcoords="offset points", xytext=(6, -10), fontsize=8, color="#555555")
        axis.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel=f"stated chance of {name}", ylabel="share that came true")
    _save(figure, title, path)


def plot_positions(races: Races, title: str, path: Path) -> None:
    """Mean simulated against official position of every car."""
    cars = [car for race in races for car in race["cars"]]
    predicted, position = np.array([c["predicted"] for c in cars]), np.array([c["position"] for c in cars])
    figure, (axis,) = _blank(1, 6.4, 6.0)
    jitter = np.random.default_rng(0).uniform(-0.25, 0.25, len(cars))
    axis.plot([1, 20], [1, 20], color=GREY, lw=1, ls="--")
    axis.scatter(predicted, position + jitter, s=12, color=BLUE, alpha=0.5, lw=0)
    edges = np.arange(1, 21, 2)
    middles = [(predicted[m].mean(), position[m].mean()) for a in edges if (m := (predicted >= a) & (predicted < a + 2)).sum() > 4]
    axis.plot(*np.array(middles).T, "o-", color=ORANGE, label="mean by predicted position")
    axis.set(xlabel="predicted: mean simulated position", ylabel="official position", xticks=range(1, 21, 3), yticks=range(1, 21, 3))
    axis.legend(frameon=False)
    _save(figure, title, path)


def plot_stops(races: Races, title: str, path: Path) -> None:
    """Stops and lap of the first stop by race: mean of the field, predicted and real."""
    names = [r["race"].rsplit("-", 1)[0] for r in races]
    figure, axes = _blank(2, 12.0, 5.6)
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
    axes[0].legend(frameon=False)
    _save(figure, title, path)


def plot_errors(modes: Mapping[str, Races], title: str, path: Path) -> None:
    """Mean error in position by race for each mode, and of the grid."""
    first = next(iter(modes.values()))
    order = np.argsort([r["mae_position"] for r in first])
    names = [first[i]["race"].rsplit("-", 1)[0] for i in order]
    figure, (axis,) = _blank(1, 9.0, 6.0)
    y = np.arange(len(names))
    for (mode, races), colour, mark in zip(modes.items(), (BLUE, GREEN, ORANGE), "Dos", strict=False):
        axis.plot([races[i]["mae_position"] for i in order], y, mark, color=colour, label=mode)
    axis.plot([first[i]["grid"]["mae_position"] for i in order], y, "|", color=GREY, ms=14, mew=2, label="grid")
    axis.set_yticks(y, names, fontsize=8)
    axis.set_xlabel("mean error, places a car")
    axis.legend(frameon=False)
    _save(figure, title, path)


def plot_race(drivers: Sequence[str], real_s: NDArray[np.float64], simulated_s: NDArray[np.float64], title: str, path: Path) -> None:
    """Race trace, real beside simulated: time behind a steady car at the winner's average; arrays [laps, cars] of race time."""
    figure, axes = _blank(2, 14.0, 6.5, share=True)
    from matplotlib import colormaps

    colours = colormaps["tab20"]
    lowest = []
    for axis, times, name in zip(axes, (real_s, simulated_s), ("as it was", "one simulated race"), strict=True):
        pace = np.nanmin(times[-1]) / len(times)
        laps = np.arange(1, len(times) + 1)
        for i, driver in enumerate(drivers):
            gap = times[:, i] - pace * laps
            axis.plot(laps, gap, color=colours(i % 20), lw=1.1)
            last = np.flatnonzero(np.isfinite(gap))
            if len(last):
                axis.annotate(driver, (laps[last[-1]] + 0.3, gap[last[-1]]), fontsize=7, va="center", annotation_clip=True)
        lowest.append(np.nanquantile(times[-1] - np.nanmin(times[-1]), 0.9) if np.isfinite(times[-1]).any() else 100.0)
        axis.set(title=name, xlabel="lap")
    axes[0].set_ylabel("behind a steady car at the winner's average, s")
    axes[0].set_ylim(max(lowest) + 30, -60)
    _save(figure, title, path)


def _blank(columns: int, width: float, height: float, share: bool = False) -> "tuple[Figure, Sequence[Axes]]":
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, columns, figsize=(width, height), squeeze=False, sharey=share)
    for axis in axes[0]:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(color="#e8e8e8", lw=0.7)
        axis.set_axisbelow(True)
    return figure, list(axes[0])


def _save(figure: "Figure", title: str, path: Path) -> None:
    from matplotlib import pyplot

    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    figure.tight_layout()
    try:
        figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder") from None
    finally:
        pyplot.close(figure)
