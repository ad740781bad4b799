"""Who an attribution shares a value out among: features of the policy's input, or groups of them that a strategist would name together."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.state import FEATURES, Feature, feature_set

MERGED: Final[dict[str, str]] = {
    "rules": "stops and sets",
    "stops": "stops and sets",
    "sets": "stops and sets",
    "gap to leader": "position",
    "last lap": "own pace",
    "clean-air outlook": "expected time",
    "track": "track and car",
    "car": "track and car",
}
"""The registry's groups that are one player: so few that all coalitions can be tried, and nothing is told twice. A group named nowhere
here stands for itself."""


@dataclass(frozen=True)
class Player:
    """One of those a value is shared out among.

    Attributes:
        label: as people know it.
        features: of the registry, those it holds.
    """

    label: str
    features: tuple[Feature, ...]


def feature_players(name: str) -> tuple[Player, ...]:
    """Each feature of a set as a player; the columns of a one-hot are one."""
    return tuple(Player(feature_text(f), (f,)) for f in feature_set(name))


def group_players(name: str) -> tuple[Player, ...]:
    """The groups of a set as players, in the order in which they first appear; those of `MERGED` together."""
    names = {f.group for f in feature_set(name)}
    joined = {to for to in MERGED.values() if len({g for g in names if MERGED.get(g, g) == to}) > 1}
    members: dict[str, list[Feature]] = {}
    for f in feature_set(name):
        merged = MERGED.get(f.group, f.group)
        members.setdefault(merged if merged in joined else f.group, []).append(f)
    return tuple(Player(label, tuple(features)) for label, features in members.items())


def column_owners(name: str, players: Sequence[Player]) -> NDArray[np.int64]:
    """Index of the player each column of a set's network input belongs to, [F]."""
    player_of = {f.name: i for i, player in enumerate(players) for f in player.features}
    return np.concatenate([np.full(f.width, player_of[f.name]) for f in feature_set(name)])


def feature_text(feature: Feature) -> str:
    """What a feature is, in words that stand alone: the registry's "the same" is written out."""
    if not feature.text.endswith(": the same"):
        return feature.text
    before = FEATURES[: [f.name for f in FEATURES].index(feature.name)]
    head = next(f.text for f in reversed(before) if not f.text.endswith(": the same"))
    call = feature.text.removesuffix(": the same")
    return f"{call}: {head.split(': ', 1)[1]}" if ": " in head else head.replace("boxing for soft", call)
