"""Traffic pooled: each track's passing threshold, one passing scale and slope; dirty air, following and lapping over all races."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.calibration.entry import RaceKey
from rsrl.calibration.pooling.scalars import PooledScalar, Spread, pool_scalar
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.calibration.race.design import Array
from rsrl.calibration.race.passing import SCALES_S, SLOPES, THRESHOLDS_S, PassingGrid
from rsrl.calibration.race.traffic import AIR_WINDOWS_S, DirtyAir
from rsrl.season import Figure

MEANS_S: Final = np.arange(0.0, 3.01, 0.1)  # of the tracks' thresholds
SPREADS_S: Final = np.geomspace(0.1, 1.6, 9)  # between tracks
MEAN_PRIOR_S: Final = (1.2, 0.8)  # 1.2-3.8 s by track without DRS in Heilmeier et al. 2020
LOG_SCALE_PRIOR: Final = (-1.0, 0.5)  # about 0.37 s
LOG_SLOPE_PRIOR: Final = (0.3, 0.7)  # about 1.35: hardly a prior
SPREAD_SCALE_S: Final = 0.4
TAIL: Final = 4.0  # degrees of freedom of the tracks' thresholds: Monaco is far from all others
RACED_S: Final = 0.25
"""What whole races ask for beyond the laps begun close behind: simulated cars that are held up all run at the following gap, real ones fall
back, so that more laps of a simulated race begin within 1 s of another car. Set on whole races of 2022-2023 (docs/realism.md)."""

NEW_CARS: Final = 2022  # first season of the rules that let cars follow more closely
EARLIER_CARS: Final = (0.20, 0.41)  # thresholds before them against the same track's later one: mean and spread, 20 circuits of 2018-2023
EARLIER_SEASON: Final = (0.0, 0.23)  # the same within 2018-2021
MIN_AIR_LAPS: Final = 20  # of a race
AIR: Final = Spread(0.3, 0.2, 0.1, 0.05, 0.1)


@dataclass(frozen=True)
class EarlierPassing:
    """Pairs of a dry race before the fitted seasons."""

    season: int
    circuit: str
    grid: PassingGrid


@dataclass(frozen=True)
class PassPool:
    """Posterior of each track's passing threshold, and of the common scale and slope."""

    thresholds: dict[str, tuple[float, float]]
    unseen: tuple[float, float]  # of a track not among the races
    scale: Figure
    per_gap: Figure
    counts: dict[str, tuple[int, int]]  # passes, pairs
    earlier: frozenset[str]  # tracks known from earlier seasons alone

    def threshold(self, circuit: str) -> Figure:
        """Pace advantage at which half the attempts succeed at a circuit."""
        value, se = self.thresholds.get(circuit, self.unseen)
        passes, pairs = self.counts.get(circuit, (0, 0))
        where = f"{passes} passes in {pairs} laps begun close behind here" if pairs else "no race here"
        where += " in earlier seasons" if circuit in self.earlier else ""
        return Figure(value, se, pairs, f"{where}; tracks about {self.unseen[0]:.2f} +- {self.unseen[1]:.2f} s")

    def as_raced(self, circuit: str) -> Figure:
        """The threshold that gives simulated races as many passes as real ones: the fitted one and `RACED_S`."""
        figure = self.threshold(circuit)
        return figure._replace(value=figure.value + RACED_S, note=f"{figure.note}; raised by {RACED_S} s to match whole races")


@dataclass(frozen=True)
class TrafficPool:
    """Traffic at any track, by the names in `TrackFigures`."""

    passing: PassPool
    air: PooledScalar  # loss at no gap
    window: Figure  # gap where it ends
    following: PooledScalar
    passed: PooledScalar
    blue: PooledScalar
    lapping: PooledScalar


def pool_traffic(analyses: Sequence[RaceAnalysis], earlier: Sequence[EarlierPassing] = ()) -> TrafficPool:
    """Pool the traffic of dry races; `earlier` speaks for the passing at circuits where these have none."""
    dry = [(a.entry, a.traffic) for a in analyses if a.traffic is not None]

    def scalar(name: str, spread: Spread, floor: float) -> PooledScalar:
        return pool_scalar([(p, getattr(t, name)) for p, t in dry if getattr(t, name) is not None], spread, floor)

    air, window = _dirty_air([(p, t.air) for p, t in dry])
    return TrafficPool(
        passing=pool_passing([(p.circuit, t.passing) for p, t in dry], carried_over([(p, t.passing) for p, t in dry], earlier)),
        air=air,
        window=window,
        following=scalar("following_s", Spread(0.6, 0.3, 0.05, 0.03, 0.05), 0.02),
        passed=scalar("passed_loss_s", Spread(0.2, 0.2, 0.1, 0.05, 0.1), 0.05),
        blue=scalar("blue_flag_s", Spread(1.0, 0.5, 0.3, 0.1, 0.2), 0.1),
        lapping=scalar("lapping_s", Spread(0.2, 0.3, 0.1, 0.05, 0.1), 0.05),
    )


def carried_over(dry: Sequence[tuple[RaceKey, PassingGrid]], earlier: Sequence[EarlierPassing]) -> list[tuple[str, PassingGrid]]:
    """What the earlier races of circuits without a dry race say of passing there now: one grid a circuit."""
    if not dry or not earlier:
        return []
    known, first = {p.circuit for p, _ in dry}, min(p.season for p, _ in dry)
    x = np.array(THRESHOLDS_S)
    found = []
    for circuit in sorted({e.circuit for e in earlier} - known):
        races = [e for e in earlier if e.circuit == circuit]
        other_cars = max(e.season for e in races) < NEW_CARS <= first
        shift, spread = EARLIER_CARS if other_cars else EARLIER_SEASON
        # rows: the threshold now; columns: the threshold then
        then = np.exp(-0.5 * ((x[None, :] - x[:, None] - shift) / spread) ** 2)
        then /= then.sum(axis=1, keepdims=True)
        likely = np.sum([np.array(e.grid.log_likelihood) for e in races], axis=0)
        top = likely.max()
        now = np.log(np.maximum(np.tensordot(then, np.exp(likely - top), axes=1), 1e-300)) + top
        nested = tuple(tuple(tuple(row) for row in rows) for rows in now.tolist())
        found.append((circuit, PassingGrid(sum(e.grid.pairs for e in races), sum(e.grid.passes for e in races), nested)))
    return found


def pool_passing(races: Sequence[tuple[str, PassingGrid]], earlier: Sequence[tuple[str, PassingGrid]] = ()) -> PassPool:
    """Thresholds of tracks about a common mean, one scale and one slope for all: the exact posterior on a grid, all else integrated out.

    Tracks are Student's t with `TAIL` degrees of freedom: one far from the others is believed to be.

    Args:
        races: circuit and pairs of each race.
        earlier: circuit and pairs of races of earlier seasons, at other circuits.
    """
    tracks = sorted({t for t, _ in [*races, *earlier]})
    scales, slopes = (v.ravel() for v in np.meshgrid(SCALES_S, SLOPES, indexing="ij"))  # one column for each pair of them
    likely = np.zeros((len(tracks), len(THRESHOLDS_S), len(scales)))
    counts: dict[str, tuple[int, int]] = {}
    for track, grid in [*races, *earlier]:
        likely[tracks.index(track)] += np.array(grid.log_likelihood).reshape(len(THRESHOLDS_S), -1)
        passes, pairs = counts.get(track, (0, 0))
        counts[track] = (passes + grid.passes, pairs + grid.pairs)
    x = np.array(THRESHOLDS_S)
    mean, spread = (v.ravel() for v in np.meshgrid(MEANS_S, SPREADS_S, indexing="ij"))
    prior = -0.5 * (TAIL + 1) * np.log1p(((x[None, :] - mean[:, None]) / spread[:, None]) ** 2 / TAIL)
    prior -= _log_sum(prior, 1)[:, None]  # [means x spreads, thresholds]
    outer = _log_normal(mean, MEAN_PRIOR_S) + np.log(spread) - spread / SPREAD_SCALE_S
    total = outer[:, None] + _log_normal(np.log(scales), LOG_SCALE_PRIOR) + _log_normal(np.log(slopes), LOG_SLOPE_PRIOR)
    own = np.zeros((len(tracks), len(mean), len(scales)))
    for t in range(len(tracks)):
        top = likely[t].max()
        own[t] = np.log(np.maximum(np.exp(prior) @ np.exp(likely[t] - top), 1e-300)) + top
    total = total + own.sum(axis=0)
    weight = np.exp(total - total.max())
    weight /= weight.sum()
    thresholds = {}
    for t, track in enumerate(tracks):
        top = likely[t].max()
        # posterior of this track's threshold: prior x likelihood, averaged over mean, spread, scale and slope
        inside = np.exp(prior).T @ (weight / np.exp(own[t] - top))  # [thresholds, scales x slopes]
        thresholds[track] = _moments(x, (inside * np.exp(likely[t] - top)).sum(axis=1))
    value = float(weight.sum(axis=1) @ mean)
    between = float(np.sqrt(weight.sum(axis=1) @ (spread**2 * TAIL / (TAIL - 2) + (mean - value) ** 2)))
    passes, pairs = (sum(c[i] for c in counts.values()) for i in (0, 1))
    note = f"{passes} passes in {pairs} laps begun close behind, all tracks given"
    scale, per_gap = (Figure(*_moments(v, weight.sum(axis=0)), pairs, note) for v in (scales, slopes))
    return PassPool(thresholds, (value, between), scale, per_gap, counts, frozenset(t for t, _ in earlier))


def _log_normal(x: Array, prior: tuple[float, float]) -> Array:
    """Log density of a normal prior (mean, sd), up to a constant."""
    return np.asarray(-0.5 * ((x - prior[0]) / prior[1]) ** 2)


def _log_sum(values: Array, axis: int) -> Array:
    top = values.max(axis=axis, keepdims=True)
    return np.asarray(np.log(np.exp(values - top).sum(axis=axis)) + top.squeeze(axis))


def _moments(x: Array, weight: Array) -> tuple[float, float]:
    w = weight / weight.sum()
    mean = float(w @ x)
    return mean, float(np.sqrt(max(float(w @ (x - mean) ** 2), 1e-4)))


def _dirty_air(races: Sequence[tuple[RaceKey, DirtyAir]]) -> tuple[PooledScalar, Figure]:
    """Loss at no gap, pooled over tracks, and the gap where it ends: least squares over all races, the latter by grid search."""
    used = [(p, r) for p, r in races if r.n > MIN_AIR_LAPS]
    if not used:
        return pool_scalar([], AIR, 0.05), Figure(3.0, 1.0, 0, "too few laps in dirty air to fit: assumed")
    n, cars = sum(r.n for _, r in used), sum(r.cars for _, r in used)
    laps_per_car = n / cars  # laps of one car are correlated: a car counts as one observation
    w = np.array([1 / max(r.sd_s, 0.1) ** 2 for _, r in used])
    xx, xe = w @ np.array([r.xx for _, r in used]), w @ np.array([r.xe for _, r in used])
    gain = np.where(xe > 0, xe**2 / xx, 0.0)
    best = int(np.argmax(gain))
    weight = np.exp((gain - gain[best]) / (2 * laps_per_car))
    centre, spread = _moments(np.array(AIR_WINDOWS_S), weight)
    width = AIR_WINDOWS_S[best]
    note = f"laps begun, and free laps ended, more than 1.1 s behind another car, {len(used)} races"
    losses = [
        (p, Figure(r.xe[best] / r.xx[best], max(r.sd_s, 0.1) * float(np.sqrt(r.n / r.cars / r.xx[best])), r.n))
        for p, r in used
        if r.xx[best] > 0
    ]
    return pool_scalar(losses, AIR, 0.03), Figure(width, float(np.hypot(spread, centre - width)), n, note)
