"""Strategists that simulate the rest of the race before each call: `planner` by candidate stops, `search` by a trained network."""

from rsrl.strategists.lookahead.planner import PlannerStrategist
from rsrl.strategists.lookahead.policy_search import PolicySearchStrategist, SearchSettings

__all__ = ["PlannerStrategist", "PolicySearchStrategist", "SearchSettings"]
