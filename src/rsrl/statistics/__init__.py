"""All intervals and bootstraps of the project: one confidence, 95 %, and one way to compute each."""

from rsrl.statistics.bootstrap import (
    RESAMPLES,
    bootstrap_over_races,
    interquartile_mean,
    mean_of_runs,
    probability_of_best,
    probability_of_improvement,
    stratified_bootstrap,
)
from rsrl.statistics.intervals import (
    CONFIDENCE,
    Estimate,
    Interval,
    Z,
    half_width,
    mean_estimate,
    mean_interval,
    normal_interval,
    paired_difference,
    proportion_interval,
    ratio_of_means,
    standard_error,
    student_interval,
)
from rsrl.statistics.seeds import mean_over_seeds

__all__ = [
    "CONFIDENCE",
    "RESAMPLES",
    "Estimate",
    "Interval",
    "Z",
    "bootstrap_over_races",
    "half_width",
    "interquartile_mean",
    "mean_estimate",
    "mean_interval",
    "mean_of_runs",
    "mean_over_seeds",
    "normal_interval",
    "paired_difference",
    "probability_of_best",
    "probability_of_improvement",
    "proportion_interval",
    "ratio_of_means",
    "standard_error",
    "stratified_bootstrap",
    "student_interval",
]
