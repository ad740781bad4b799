"""Tyres from lap times and from what teams chose together.

Lap times tell how a stint that a driver made last went by; choices tell what a lap more on a set costs, and where a set ends. The race
takes a weighted mean of both, and the base lap and the gain over the race move with it as lap times say they must.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from rsrl.calibration.choices import ChoiceModel, Setting, settings_before
from rsrl.calibration.entry import RaceEntry
from rsrl.calibration.pooling.tyre import TyrePool
from rsrl.season import COMPOUNDS, Figure

CHOICE_SHARE: Final = 0.8
"""Weight of choices; chosen on 2023 (docs/calibration.md)."""


@dataclass(frozen=True)
class JointTyres:
    """Tyres of any race; the same questions as `TyrePool` answers."""

    laps: TyrePool
    choices: ChoiceModel
    share: float = CHOICE_SHARE

    _found: dict[str, dict[str, Figure]] = field(default_factory=dict, init=False, repr=False, compare=False)  # by race

    def base_lap(self, entry: RaceEntry) -> Figure:
        """Lap of the average starter on fresh mediums with an empty tank, on the track as it is at the flag."""
        return self._figures(entry)["base"]

    def evolution(self, entry: RaceEntry) -> Figure:
        """What the track gains over the race beyond the fuel burned."""
        return self._figures(entry)["evolution"]

    def fuel(self, entry: RaceEntry) -> Figure:
        """Lap time per kg, by the length of the lap."""
        return self.laps.fuel(entry)

    def offset(self, entry: RaceEntry, letter: str) -> Figure:
        """Fresh compound against the fresh medium."""
        return self._figures(entry)[f"offset {letter}"]

    def wear(self, entry: RaceEntry, letter: str) -> Figure:
        """Wear per lap of a fresh set."""
        return self._figures(entry)[f"wear {letter}"]

    def _figures(self, entry: RaceEntry) -> dict[str, Figure]:
        if entry.name not in self._found:
            self._found[entry.name] = self._compute(entry)
        return self._found[entry.name]

    def _compute(self, entry: RaceEntry) -> dict[str, Figure]:
        chosen = self.choices.tyres(setting_of(entry, self.choices))
        note = f"lap times and, with weight {self.share:g}, the choices of {len(self.choices.rows)} races"
        figures: dict[str, Figure] = {}
        for i, letter in enumerate(COMPOUNDS):
            lap_wear, lap_offset = self.laps.wear(entry, letter), self.laps.offset(entry, letter)
            wear = float(np.exp(chosen.log_wear[i]))
            figures[f"wear {letter}"] = self._between(lap_wear, wear, wear * chosen.log_wear_sd[i], note)
            own = note if letter != "M" else lap_offset.note
            figures[f"offset {letter}"] = self._between(lap_offset, chosen.offset_s[i], chosen.offset_sd[i], own)
        base, gain = self.laps.moved(entry, {name: f.value for name, f in figures.items()})
        before, evolution = self.laps.base_lap(entry), self.laps.evolution(entry)
        figures["base"] = before._replace(value=before.value + base)
        figures["evolution"] = evolution._replace(value=evolution.value + gain)
        return figures

    def _between(self, laps: Figure, chosen: float, chosen_sd: float, note: str) -> Figure:
        """The weighted mean of what lap times and choices say, their errors taken as independent."""
        value = (1 - self.share) * laps.value + self.share * chosen
        return Figure(float(value), float(np.hypot((1 - self.share) * laps.se, self.share * chosen_sd)), laps.n, note)


def setting_of(entry: RaceEntry, choices: ChoiceModel) -> Setting:
    """The setting of a race for the choice model; its stop costs what stops cost there before."""
    return settings_before(
        entry.season, entry.round, entry.circuit, entry.laps, entry.c_numbers, entry.max_laps_per_set, choices.history, entry.min_sets - 1
    )
