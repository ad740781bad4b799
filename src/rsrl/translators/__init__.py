"""Sources of races translated to `UnifiedRaceState`, and `UnifiedRaceStrategy` translated back. So far there is one: the simulator."""

from rsrl.translators.interface import Translator
from rsrl.translators.simulator import SimulatedRace, simulated_state

__all__ = ["SimulatedRace", "Translator", "simulated_state"]
