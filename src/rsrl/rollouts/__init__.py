"""Races run on from a state to the flag: futures, rollouts of plans and of policies, training branches; the one compiled network."""

from rsrl.rollouts.belief import belief_of
from rsrl.rollouts.branching import Branches, Branching, BranchingRaces, greedy_positions
from rsrl.rollouts.futures import prior_belief
from rsrl.rollouts.pace_filter import PaceFilter
from rsrl.rollouts.plans import Foresight, lookahead_memory, run_on

__all__ = [
    "Branches",
    "Branching",
    "BranchingRaces",
    "Foresight",
    "PaceFilter",
    "belief_of",
    "greedy_positions",
    "lookahead_memory",
    "prior_belief",
    "run_on",
]
