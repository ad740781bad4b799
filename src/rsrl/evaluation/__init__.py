"""Paired comparisons of strategists, the leaderboard and its figures."""

from rsrl.evaluation.figures import plot_positions
from rsrl.evaluation.gap import gap_closed
from rsrl.evaluation.leaderboard import leaderboard
from rsrl.evaluation.paired import APART, RaceLog, first_unseen_race, run_in, run_races
from rsrl.evaluation.robustness import RobustnessPlan, robustness
from rsrl.evaluation.seeds import SeedsResult, over_seeds
from rsrl.evaluation.self_play import PolicyField, self_play
from rsrl.evaluation.strategies import common_strategies

__all__ = [
    "APART",
    "PolicyField",
    "RaceLog",
    "RobustnessPlan",
    "SeedsResult",
    "common_strategies",
    "first_unseen_race",
    "gap_closed",
    "leaderboard",
    "over_seeds",
    "plot_positions",
    "robustness",
    "run_in",
    "run_races",
    "self_play",
]
