"""A race in words: the laps that mattered, why each stop was made, and where the policy is out of its depth."""

from rsrl.explanation.summary.driven import DrivenRace, drive
from rsrl.explanation.summary.race import RaceSummary, summarise_race
from rsrl.explanation.summary.usual import state_warnings
from rsrl.explanation.summary.wording import Reference, Sentence, value_unit

__all__ = ["DrivenRace", "RaceSummary", "Reference", "Sentence", "drive", "state_warnings", "summarise_race", "value_unit"]
