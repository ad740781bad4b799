"""Attribution: a decision's value shared out among features, groups of them, laps or cells by Shapley's rule, as TimeSHAP defines it."""

from rsrl.explanation.attribution.backgrounds import (
    BACKGROUNDS,
    Background,
    ReferenceRaces,
    drive_references,
    make_background,
    read_row,
)
from rsrl.explanation.attribution.explain import LEVELS, TARGETS, explain_attribution
from rsrl.explanation.attribution.players import Player, feature_players, group_players
from rsrl.explanation.attribution.shapley import Shapley, exact_shares, interaction_indices, shapley
from rsrl.explanation.attribution.values import Game, ValueFunction

__all__ = [
    "BACKGROUNDS",
    "LEVELS",
    "TARGETS",
    "Background",
    "Game",
    "Player",
    "ReferenceRaces",
    "Shapley",
    "ValueFunction",
    "drive_references",
    "exact_shares",
    "explain_attribution",
    "feature_players",
    "group_players",
    "interaction_indices",
    "make_background",
    "read_row",
    "shapley",
]
