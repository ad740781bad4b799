"""What the lap times of one race say of its tyres, for the likelihood of choices: slope of a stint and level of each compound."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from rsrl.calibration.choices import LapFigures
from rsrl.calibration.compounds import REFERENCE_KM, lap_km
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.season import COMPOUNDS

GAIN: Final = (3.4, 0.8)
"""Gain from start to flag at `REFERENCE_KM`, s: 110 kg x 0.031 s, and what the track may add or take. Without it one race cannot tell wear
from gain."""

FEWEST_LAPS: Final = 60  # on a compound


def lap_figures_of(analyses: Sequence[RaceAnalysis]) -> dict[tuple[int, int], LapFigures]:
    """Lap figures of races by season and round; those without a pace model are absent."""
    found = ((a.entry.season_round, lap_figures(a)) for a in analyses)
    return {key: figures for key, figures in found if figures is not None}


def lap_figures(analysis: RaceAnalysis) -> LapFigures | None:
    """Slopes and levels of one race, its gain held near `GAIN`; None where it has no pace model."""
    pace = analysis.pace
    if pace is None:
        return None
    share = lap_km(analysis.entry.laps) / REFERENCE_KM
    at = {name: i for i, name in enumerate(pace.names)}
    mean, cov = pace.shared.copy(), pace.shared_cov.copy()
    if "gain" in at:  # one more observation, of the gain
        j = at["gain"]
        weight = cov[:, j] / (cov[j, j] + (GAIN[1] * share) ** 2)
        mean, cov = mean + weight * (GAIN[0] * share - mean[j]), cov - np.outer(weight, cov[j])
    figures = np.full((4, len(COMPOUNDS)), np.nan)
    enough = {c: pace.laps_by_letter.get(c, 0) >= FEWEST_LAPS for c in COMPOUNDS}
    for i, letter in enumerate(COMPOUNDS):
        for row, name in ((0, f"wear {letter}"), (2, f"offset {letter}")):
            if name in at and enough[letter] and (row == 0 or enough["M"]):
                j = at[name]
                figures[row, i], figures[row + 1, i] = mean[j], np.sqrt(max(cov[j, j], 0.0))
    return LapFigures(*figures)
