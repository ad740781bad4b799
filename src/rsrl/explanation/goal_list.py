"""The goals themselves: the paper's figures and what is asked for here, method by method."""

from typing import Final

from rsrl.explanation.fidelity.goals import Goal

DRIVING_RACES: Final = 1920
FIDELITY_RACES: Final = 100
"""Races below which a figure is not judged."""

GOALS: Final = (
    Goal(
        "attribution", "shares add up: largest gap over the range of Q", "error 5 %, of what is not said",
        "efficiency_gap_of_q_range.largest", "<", 1e-5, FIDELITY_RACES,
    ),
    Goal("attribution", "share of decisions explained exactly", "", "exact_share", "=", 1.0, FIDELITY_RACES),
    Goal("attribution", "seconds for an exact one, 95th percentile", "", "seconds.p95", "<", 0.5, FIDELITY_RACES),
    Goal("attribution", "sampled values against exact ones, mean error", "", "sampled.relative_error.mean", "<", 0.02, FIDELITY_RACES),
    Goal("attribution", "Kendall tau of them across seeds", "", "sampled.kendall_tau_across_seeds.mean", ">", 0.95, FIDELITY_RACES),
    Goal(
        "attribution", "insertion curve outside the random band, share of its points", "",
        "curves.insertion.outside_band_share_of_points", "=", 1.0, FIDELITY_RACES,
    ),
    Goal(
        "attribution", "deletion curve outside the random band, share of its points", "",
        "curves.deletion.outside_band_share_of_points", "=", 1.0, FIDELITY_RACES,
    ),
    Goal("tree", "accuracy, against the commonest call", ".926, below .933", "labels.accuracy", ">", "labels.majority", FIDELITY_RACES),
    Goal("tree", "macro-F1", ".34", "labels.macro_f1", ">", 0.60, FIDELITY_RACES),
    Goal("tree", "right compound within one lap", ".15 of stops found", "stops.within_one_lap.value", ">", 0.70, FIDELITY_RACES),
    Goal("tree", "leaves", "", "leaves", "<=", 48.0),
    Goal("tree", "places behind the policy, upper end of 95 %", "not measured", "behind_policy.ci95.1", "<", 0.2, DRIVING_RACES),
    Goal("tree", "places ahead of fixed, lower end of 95 %", "not measured", "ahead_of_fixed.ci95.0", ">", 0.0, DRIVING_RACES),
    Goal("tree", "places ahead of heuristic, lower end of 95 %", "not measured", "ahead_of_heuristic.ci95.0", ">", 0.0, DRIVING_RACES),
    Goal("counterfactual", "those shown that the policy confirms", "not checked", "best_other.confirmed.value", "=", 1.0, FIDELITY_RACES),
    Goal("counterfactual", "found, for the best other call", "", "best_other.found.value", ">", 0.80, FIDELITY_RACES),
    Goal("counterfactual", "found, for a random other call", "", "random.found.value", ">", 0.80, FIDELITY_RACES),
    Goal("counterfactual", "changes, for the best other call", "1.63", "best_other.causes_changed.value", "<=", 1.6, FIDELITY_RACES),
    Goal("counterfactual", "changes, for a random other call", "1.63", "random.causes_changed.value", "<=", 1.6, FIDELITY_RACES),
    Goal("counterfactual", "ms for tree and check, mean", "", "best_other.wall_ms.mean", "<", 50.0, FIDELITY_RACES),
    Goal("what-if", "seconds for all options, the slowest moment", "", "seconds_most", "<", 2.0),
    Goal("what-if", "share of 95 % intervals that hold, upper end", "", "coverage_high", ">=", 0.95),
    Goal("what-if", "share of 95 % intervals that hold, lower end", "", "coverage_low", "<=", 0.95),
    Goal("all", "seconds for all of it, one lap", "", "seconds.median", "<", 3.0),
)  # fmt: skip
"""A goal is added here, never taken away for being missed."""
