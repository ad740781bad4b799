"""Paired comparisons of strategists, the leaderboard and its figures."""

from rsrl.evaluation.leaderboard import Row, leaderboard, mean_interval
from rsrl.evaluation.paired import RaceLog, run_races

__all__ = ["RaceLog", "Row", "leaderboard", "mean_interval", "run_races"]
