"""What teams chose, and what it says of the tyres: a discrete choice model of plans, pooled over circuits, seasons and C-numbers."""

from rsrl.calibration.choices.arrays import LapFigures, Setting, setting_before, settings_before
from rsrl.calibration.choices.fit import ChoiceFits
from rsrl.calibration.choices.model import ChoiceModel, RacePlans, RaceTyres
from rsrl.calibration.choices.observed import CarChoice, RaceChoices, choices_in, race_choices, read_choices
from rsrl.calibration.choices.parameters import grid_group
from rsrl.calibration.choices.sequences import SEQUENCE_INDEX, SEQUENCES, sequence_name

__all__ = [
    "SEQUENCES",
    "SEQUENCE_INDEX",
    "CarChoice",
    "ChoiceFits",
    "ChoiceModel",
    "LapFigures",
    "RaceChoices",
    "RacePlans",
    "RaceTyres",
    "Setting",
    "choices_in",
    "grid_group",
    "race_choices",
    "read_choices",
    "sequence_name",
    "setting_before",
    "settings_before",
]
