"""Races rolled out from a state to the flag: futures and beliefs, rollouts of plans, options and policies, training branches."""

from rsrl.rollouts.batch_kernels import (
    O_AHEAD,
    O_BEHIND,
    O_COLUMNS,
    O_FINISHED,
    O_PIT,
    O_PLACE,
    O_POSITION,
    O_SLOW,
    O_STOP_LAP,
    O_TIME,
    O_TYRE,
)
from rsrl.rollouts.belief import belief_of
from rsrl.rollouts.branching import Branches, Branching, BranchingRaces, greedy_positions
from rsrl.rollouts.compiled_network import CompiledNetwork, compiled_network, network_memory, value_rows
from rsrl.rollouts.compiled_policy import policy_inputs
from rsrl.rollouts.future_batch import FutureBatch
from rsrl.rollouts.futures import B_PACE, B_PACE_SD, B_ROWS, B_STINT, B_STINT_BY_PACE, B_STINT_SD, B_USE, prior_belief
from rsrl.rollouts.options import STAY, Option, OptionRollouts, Progress
from rsrl.rollouts.pace_filter import PaceFilter
from rsrl.rollouts.plans import (
    BY_COST,
    PLAN_COLUMNS,
    PLAN_POSITION,
    PLAN_SMOOTH_POSITION,
    PLAN_TIME,
    CostToGo,
    RolloutMemory,
    roll_out_plans,
    rollout_memory,
)
from rsrl.rollouts.policy import PolicyRollouts

__all__ = [
    "BY_COST",
    "B_PACE",
    "B_PACE_SD",
    "B_ROWS",
    "B_STINT",
    "B_STINT_BY_PACE",
    "B_STINT_SD",
    "B_USE",
    "O_AHEAD",
    "O_BEHIND",
    "O_COLUMNS",
    "O_FINISHED",
    "O_PIT",
    "O_PLACE",
    "O_POSITION",
    "O_SLOW",
    "O_STOP_LAP",
    "O_TIME",
    "O_TYRE",
    "PLAN_COLUMNS",
    "PLAN_POSITION",
    "PLAN_SMOOTH_POSITION",
    "PLAN_TIME",
    "STAY",
    "Branches",
    "Branching",
    "BranchingRaces",
    "CompiledNetwork",
    "CostToGo",
    "FutureBatch",
    "Option",
    "OptionRollouts",
    "PaceFilter",
    "PolicyRollouts",
    "Progress",
    "RolloutMemory",
    "belief_of",
    "compiled_network",
    "greedy_positions",
    "network_memory",
    "policy_inputs",
    "prior_belief",
    "roll_out_plans",
    "rollout_memory",
    "value_rows",
]
