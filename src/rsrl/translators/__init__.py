"""Sources of races translated to `UnifiedRaceState`, and `UnifiedRaceStrategy` translated back: the simulator, and any feed of events."""

from rsrl.translators.health import Health
from rsrl.translators.interface import Translator
from rsrl.translators.race_tracker import News, RaceTracker
from rsrl.translators.simulator import SimulatedRace, simulated_state
from rsrl.translators.tracked_car import Stint, TrackedCar, Visit
from rsrl.translators.tracked_gaps import standings
from rsrl.translators.tracked_state import Tracked, TrackedStates

__all__ = [
    "Health",
    "News",
    "RaceTracker",
    "SimulatedRace",
    "Stint",
    "Tracked",
    "TrackedCar",
    "TrackedStates",
    "Translator",
    "Visit",
    "simulated_state",
    "standings",
]
