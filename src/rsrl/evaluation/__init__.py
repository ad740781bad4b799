"""Paired comparisons of strategists, the leaderboard and its figures."""

from rsrl.evaluation.figures import StintBar, plot_positions, plot_strategies
from rsrl.evaluation.gap import gap_closed
from rsrl.evaluation.intervals import mean_interval
from rsrl.evaluation.leaderboard import Row, leaderboard
from rsrl.evaluation.paired import RaceLog, run_races
from rsrl.evaluation.strategies import CommonStrategy, common_strategies

__all__ = [
    "CommonStrategy",
    "RaceLog",
    "Row",
    "StintBar",
    "common_strategies",
    "gap_closed",
    "leaderboard",
    "mean_interval",
    "plot_positions",
    "plot_strategies",
    "run_races",
]
