"""Attribution: Shapley values of a decision for features, groups of them, laps or cells, as TimeSHAP defines them."""

from rsrl.explanation.attribution.backgrounds import (
    BACKGROUNDS,
    Background,
    ReferenceRaces,
    drive_references,
    make_background,
    read_row,
)
from rsrl.explanation.attribution.explain import LEVELS, TARGETS, explain_attribution
from rsrl.explanation.attribution.shapley import ShapleyValues, exact_values, interaction_indices, shapley_values
from rsrl.explanation.attribution.timeshap import Player, feature_players, group_players
from rsrl.explanation.attribution.values import Game, ValueFunction

__all__ = [
    "BACKGROUNDS",
    "LEVELS",
    "TARGETS",
    "Background",
    "Game",
    "Player",
    "ReferenceRaces",
    "ShapleyValues",
    "ValueFunction",
    "drive_references",
    "exact_values",
    "explain_attribution",
    "feature_players",
    "group_players",
    "interaction_indices",
    "make_background",
    "read_row",
    "shapley_values",
]
