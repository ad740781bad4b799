"""Tyres pooled: base lap, gain over the race, wear and offset of every compound, over tracks, seasons and Pirelli's C-numbers.

Each race gives a vector of these with its joint covariance, since one race hardly tells wear from gain. A compound has a hardness (its
C-number). Wear and level are each a common step from one hardness to the next, plus deviations of the hardness, the track and the race.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rsrl.calibration.compounds import REFERENCE_KM, hardness, lap_km
from rsrl.calibration.entry import RaceEntry, RaceKey
from rsrl.calibration.literature import FUEL_S_PER_KG, FUEL_START
from rsrl.calibration.pooling.mixed_effects import Effect, Group, Mixed, block_diagonal, fit_mixed
from rsrl.calibration.pooling.scalars import PooledScalar, Spread, pool_scalar
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.season import Figure

MIDDLE_HARDNESS: Final = 3
MIN_WEAR: Final = 0.0
OVER_POLE: Final = Spread(1.055, 0.02, 0.008, 0.005, 0.006)
GROUPS: Final[dict[str, Group]] = {
    "base": Group(30.0, 90.0, learned=False),
    "base km": Group(10.0, 15.0, learned=False),
    "base track": Group(6.0),
    "base season": Group(0.7),
    "base race": Group(0.5),
    "gain": Group(1.0, 3.4, learned=False),
    "gain track": Group(0.5),
    "gain season": Group(0.3),
    "gain race": Group(0.5),
    "wear": Group(0.04, 0.05, learned=False),
    "wear step": Group(0.015, 0.01, learned=False),
    "wear hardness": Group(0.01),
    "wear track": Group(0.03),
    "wear season": Group(0.01),
    "wear race": Group(0.015),
    "wear own": Group(0.01),
    "wear rest": Group(0.01),
    "level step": Group(0.3, -0.4, learned=False),
    "level hardness": Group(0.2),
    "level track": Group(0.15),
    "level rest": Group(0.15),
}
_Terms = dict[Effect, float]


@dataclass(frozen=True)
class TyrePool:
    """The pooled model, for any race."""

    model: Mixed
    races: tuple[tuple[RaceKey, tuple[tuple[int, int], ...]], ...]  # race, ((hardness, laps), ...)
    km: dict[str, float]  # length of a lap by track
    over_pole: PooledScalar  # base lap over the best qualifying lap

    def base_lap(self, entry: RaceEntry) -> Figure:
        """Lap of the average starter on fresh mediums with an empty tank, on the track as it is at the flag."""
        value, se = self.model.predict(_base(entry, self._km(entry)))
        if entry.pole_s is None or entry.circuit in self.km:
            return Figure(value, se, self._laps(entry, None), self._note(entry, "level of the race, season and track"))
        ratio = self.over_pole.at(entry)
        return Figure(
            entry.pole_s * ratio.value,
            entry.pole_s * ratio.se,
            0,
            f"best qualifying lap x {ratio.value:.3f}: no dry race here among those given",
        )

    def evolution(self, entry: RaceEntry) -> Figure:
        """What the track gains over the race beyond the fuel burned."""
        value, se = self.model.predict(_gain(entry, self._km(entry)))
        fuel = self.fuel(entry)
        note = self._note(entry, f"gain of {value:.2f} s over the race less {fuel.value:.4f} s/kg of fuel")
        return Figure(
            value - fuel.value * FUEL_START.value, float((se**2 + (fuel.se * FUEL_START.value) ** 2) ** 0.5), len(self.races), note
        )

    def fuel(self, entry: RaceEntry) -> Figure:
        """Lap time per kg, by the length of the lap."""
        share = self._km(entry) / REFERENCE_KM
        note = f"0.031 s/kg at {REFERENCE_KM:g} km from the literature, by the length of the lap; the rest is evolution_s"
        return Figure(FUEL_S_PER_KG[0] * share, FUEL_S_PER_KG[1] * share, 0, note)

    def wear(self, entry: RaceEntry, letter: str) -> Figure:
        """Wear per lap of a compound."""
        value, se = self.model.predict(_wear(entry, letter))
        n = self._laps(entry, hardness(entry.c_numbers[letter], entry.season))
        note = self._note(entry, "wear pooled over C-numbers, tracks and seasons") + ("; never below zero" if value < MIN_WEAR else "")
        return Figure(max(value, MIN_WEAR), se, n, note)

    def offset(self, entry: RaceEntry, letter: str) -> Figure:
        """Fresh compound against the fresh medium."""
        n = self._laps(entry, hardness(entry.c_numbers[letter], entry.season))
        if letter == "M":
            return Figure(0.0, 0.0, n, "the reference")
        value, se = self.model.predict(_offset(entry, letter))
        return Figure(value, se, n, self._note(entry, "offset pooled over C-numbers, tracks and seasons"))

    def moved(self, entry: RaceEntry, tyres: Mapping[str, float]) -> tuple[float, float]:
        """What base lap and gain move by, s, where other figures of the tyres are taken: the lap times stay explained.

        Args:
            tyres: the other figures, such as `wear S` and `offset H`.
        """
        names = [n for n in tyres if n != "offset M"]
        terms = [_wear(entry, n[-1]) if n.startswith("wear") else _offset(entry, n[-1]) for n in names]
        means, cov = self.model.predict_all([_base(entry, self._km(entry)), _gain(entry, self._km(entry)), *terms])
        other = np.array([tyres[n] for n in names]) - means[2:]
        ridge = 1e-9 * np.eye(len(names))
        base, gain = cov[:2, 2:] @ np.linalg.solve(cov[2:, 2:] + ridge, other)
        return float(base), float(gain)

    def _km(self, entry: RaceEntry) -> float:
        return self.km.get(entry.circuit, lap_km(entry.laps))

    def _laps(self, entry: RaceEntry, on: int | None) -> int:
        """Laps driven at this Grand Prix on a hardness, or (None) on any."""
        return sum(n for race, laps in self.races if race.circuit == entry.circuit for k, n in laps if on in (None, k))

    def _note(self, entry: RaceEntry, what: str) -> str:
        here = [race for race, _ in self.races if race.circuit == entry.circuit]
        own = "this race among them" if any((p.season, p.round) == entry.season_round for p in here) else "not this race"
        return f"{what}: {len(self.races)} dry races, {len(here)} here, {own}"


def pool_tyres(analyses: Sequence[RaceAnalysis]) -> TyrePool | None:
    """Pool what dry races share; None without one."""
    blocks, values, rows, races = [], [], [], []
    km: dict[str, float] = {}
    for a in analyses:
        if a.dry:
            km[a.entry.circuit] = min(km.get(a.entry.circuit, 99.0), lap_km(a.entry.laps))
    for analysis in analyses:
        pace, entry = analysis.pace, analysis.entry
        if pace is None:
            continue
        blocks.append(pace.shared_cov)
        values += pace.shared.tolist()
        rows += list(_rows(entry, pace.names, km[entry.circuit]))
        counted = tuple((hardness(entry.c_numbers[c], entry.season), n) for c, n in pace.laps_by_letter.items())
        races.append((entry, counted))
    if not races:
        return None
    poles = [
        (a.entry, Figure(a.pace.base_lap_s.value / a.entry.pole_s, a.pace.base_lap_s.se / a.entry.pole_s, 1))
        for a in analyses
        if a.pace is not None and a.entry.pole_s is not None
    ]
    return TyrePool(fit_mixed(values, block_diagonal(blocks), rows, GROUPS), tuple(races), km, pool_scalar(poles, OVER_POLE, 0.001))


def _rows(entry: RaceEntry, names: Sequence[str], km: float) -> Iterator[_Terms]:
    for name in names:
        if name == "base":
            yield _base(entry, km)
        elif name == "gain":
            yield _gain(entry, km)
        else:
            kind, letter = name.split()
            yield _wear(entry, letter) if kind == "wear" else _offset(entry, letter)


def _at(entry: RaceEntry, kind: str, factor: float = 1.0) -> _Terms:
    track, season, race = entry.circuit, str(entry.season), entry.label
    return {(f"{kind} track", track): factor, (f"{kind} season", season): factor, (f"{kind} race", race): factor}


def _base(entry: RaceEntry, km: float) -> _Terms:
    """The medium's own hardness counts: a harder medium makes a slower base lap."""
    k = hardness(entry.c_numbers["M"], entry.season) - MIDDLE_HARDNESS
    level: _Terms = {("level step", "all"): float(k), ("level hardness", str(k)): 1.0, ("level track", entry.circuit): float(k)}
    return {("base", "all"): 1.0, ("base km", "all"): km - REFERENCE_KM} | _at(entry, "base") | level


def _gain(entry: RaceEntry, km: float) -> _Terms:
    share = km / REFERENCE_KM
    return {("gain", "all"): share} | _at(entry, "gain", share)


def _wear(entry: RaceEntry, letter: str) -> _Terms:
    k = hardness(entry.c_numbers[letter], entry.season) - MIDDLE_HARDNESS
    own: _Terms = {
        ("wear", "all"): 1.0,
        ("wear step", "all"): float(k),
        ("wear hardness", str(k)): 1.0,
        ("wear own", f"{entry.circuit}/{k}"): 1.0,
        ("wear rest", f"{entry.label}/{letter}"): 1.0,
    }
    return own | _at(entry, "wear")


def _offset(entry: RaceEntry, letter: str) -> _Terms:
    k = hardness(entry.c_numbers[letter], entry.season) - MIDDLE_HARDNESS
    m = hardness(entry.c_numbers["M"], entry.season) - MIDDLE_HARDNESS
    found: _Terms = {("level step", "all"): float(k - m), ("level track", entry.circuit): float(k - m)}
    if k != m:
        found |= {("level hardness", str(k)): 1.0, ("level hardness", str(m)): -1.0}
    return found | {("level rest", f"{entry.label}/{letter}"): 1.0}
