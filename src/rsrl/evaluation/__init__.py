"""Paired comparisons of strategists, the leaderboard and its figures."""

from rsrl.evaluation.figures import plot_positions
from rsrl.evaluation.gap import gap_closed
from rsrl.evaluation.leaderboard import Row, leaderboard
from rsrl.evaluation.paired import APART, RaceLog, run_in, run_races
from rsrl.evaluation.robustness import Against, RobustnessPlan, RobustnessRow, robustness
from rsrl.evaluation.seeds import Comparison, SeedsResult, over_seeds
from rsrl.evaluation.self_play import PolicyField, self_play
from rsrl.evaluation.strategies import CommonStrategy, common_strategies

__all__ = [
    "APART",
    "Against",
    "CommonStrategy",
    "Comparison",
    "PolicyField",
    "RaceLog",
    "RobustnessPlan",
    "RobustnessRow",
    "Row",
    "SeedsResult",
    "common_strategies",
    "gap_closed",
    "leaderboard",
    "over_seeds",
    "plot_positions",
    "robustness",
    "run_in",
    "run_races",
    "self_play",
]
