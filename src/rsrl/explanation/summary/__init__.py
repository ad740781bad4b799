"""A race in words: the laps that mattered, why each stop was made, and what lies outside the policy's training."""

from rsrl.explanation.summary.race import RaceSummary, summarise_race
from rsrl.explanation.summary.state_warnings import state_warnings
from rsrl.explanation.summary.wording import Reference, Sentence

__all__ = ["RaceSummary", "Reference", "Sentence", "state_warnings", "summarise_race"]
