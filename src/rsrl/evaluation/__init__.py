"""Paired comparisons of strategists, the leaderboard and its figures."""

from rsrl.evaluation.figures import StintBar, plot_positions, plot_strategies
from rsrl.evaluation.leaderboard import Row, leaderboard, mean_interval
from rsrl.evaluation.paired import APART, RaceLog, run_races
from rsrl.evaluation.strategies import CommonStrategy, common_strategies

__all__ = [
    "APART",
    "CommonStrategy",
    "RaceLog",
    "Row",
    "StintBar",
    "common_strategies",
    "leaderboard",
    "mean_interval",
    "plot_positions",
    "plot_strategies",
    "run_races",
]
