"""Paired comparisons of strategists, the leaderboard and its figures."""

from rsrl.evaluation.figures import StintBar, plot_positions, plot_strategies
from rsrl.evaluation.gap import gap_closed
from rsrl.evaluation.intervals import mean_interval
from rsrl.evaluation.leaderboard import Row, leaderboard
from rsrl.evaluation.paired import APART, RaceLog, run_in, run_races
from rsrl.evaluation.robustness import Against, RobustnessPlan, RobustnessRow, robustness
from rsrl.evaluation.seeds import Comparison, SeedsResult, over_seeds
from rsrl.evaluation.self_play import PolicyField, self_play
from rsrl.evaluation.statistics import (
    Estimate,
    interquartile_mean,
    mean_over_seeds,
    probability_of_improvement,
    stratified_bootstrap,
)
from rsrl.evaluation.strategies import CommonStrategy, common_strategies

__all__ = [
    "APART",
    "Against",
    "CommonStrategy",
    "Comparison",
    "Estimate",
    "PolicyField",
    "RaceLog",
    "RobustnessPlan",
    "RobustnessRow",
    "Row",
    "SeedsResult",
    "StintBar",
    "common_strategies",
    "gap_closed",
    "interquartile_mean",
    "leaderboard",
    "mean_interval",
    "mean_over_seeds",
    "over_seeds",
    "plot_positions",
    "plot_strategies",
    "probability_of_improvement",
    "robustness",
    "run_in",
    "run_races",
    "self_play",
    "stratified_bootstrap",
]
