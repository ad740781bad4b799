"""Sources of races, translated to `UnifiedRaceState`, and `UnifiedRaceStrategy` translated back; the simulator is the first."""

from rsrl.translators.interface import Translator
from rsrl.translators.simulator import SimulatedRace, simulated_state

__all__ = ["SimulatedRace", "Translator", "simulated_state"]
