"""One interface, many ways to call a race: fixed plans, a heuristic, plan search, a trained policy."""

from rsrl.strategists.factory import STRATEGISTS, make_strategist
from rsrl.strategists.interface import Strategist
from rsrl.strategists.planned import FixedStrategist, PlannedStrategist
from rsrl.strategists.policy import PolicyStrategist, find_model

__all__ = [
    "STRATEGISTS",
    "FixedStrategist",
    "PlannedStrategist",
    "PolicyStrategist",
    "Strategist",
    "find_model",
    "make_strategist",
]
