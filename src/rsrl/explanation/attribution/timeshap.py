"""Players of a value function, as TimeSHAP (Bento et al., 2021) has them: features, events (laps) and cells, and its pruning of old laps.

A feature, or a group of features that a strategist would name together, is a player on all laps; an event is all features of one lap; a
cell is one feature on one lap.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.explanation.attribution.values import Doubles, Floats, ValueFunction
from rsrl.explanation.quantities import feature_text
from rsrl.state import Feature, feature_set

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
"""Groups of the registry that are one player, so that players are few enough to evaluate all coalitions. Other groups are one each."""

TOLERANCE: Final = 0.025
"""Share of |v(state) - v(background)| under which older laps are pruned; TimeSHAP's 0.025 is of a probability, whose range is 1."""

CELL_LAPS: Final = 3
CELL_FEATURES: Final = 2
"""The most important laps and features that are split into cells. With the rest of them there are at most (3 + 1) (2 + 1) + 1 = 13 players,
few enough to evaluate all coalitions."""


@dataclass(frozen=True)
class Player:
    """A player that is one feature or a group of them.

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
    """The groups of a set as players, in the order in which they first appear; those of `MERGED` are one where the set has several."""
    names = {f.group for f in feature_set(name)}
    joined = {to for to in MERGED.values() if len({g for g in names if MERGED.get(g, g) == to}) > 1}
    members: dict[str, list[Feature]] = {}
    for f in feature_set(name):
        merged = MERGED.get(f.group, f.group)
        members.setdefault(merged if merged in joined else f.group, []).append(f)
    return tuple(Player(label, tuple(features)) for label, features in members.items())


def column_owners(name: str, players: Sequence[Player]) -> NDArray[np.int64]:
    """Index of the player that each column of a set's network input belongs to, [F]."""
    player_of = {f.name: i for i, player in enumerate(players) for f in player.features}
    return np.concatenate([np.full(f.width, player_of[f.name]) for f in feature_set(name)])


@dataclass(frozen=True)
class Cells:
    """Players as sets of cells of the laps so far.

    Attributes:
        labels: name of each player.
        owners: player that each cell of the network input belongs to, int [T, F].
    """

    labels: tuple[str, ...]
    owners: NDArray[np.int64]


def feature_level(name: str, players: Sequence[Player], laps: int) -> Cells:
    """Each player holds its columns on every lap: v(z) = f(D_z X + (I - D_z) B)."""
    return Cells(tuple(p.label for p in players), np.tile(column_owners(name, players), (laps, 1)))


def event_level(laps: int, columns: int, pruned: int) -> Cells:
    """Each lap is a player, the first `pruned` of them together one: v(z) = f(X D_z + B (I - D_z))."""
    owners = np.maximum(np.arange(laps) - max(pruned - 1, 0), 0)
    labels = (*_pruned_label(pruned), *(f"lap {lap}" for lap in range(pruned + 1, laps + 1)))
    return Cells(labels, np.repeat(owners[:, None], columns, axis=1))


def cell_level(name: str, players: Sequence[Player], laps: int, pruned: int, chosen: Sequence[int], features: Sequence[int]) -> Cells:
    """Cells of the laps `chosen` (indices) and the players `features`; the rest of each lap, of each feature, and of both, together."""
    owner = column_owners(name, players)
    labels, owners = list(_pruned_label(pruned)), np.full((laps, len(owner)), -1)
    owners[:pruned] = 0
    later = np.arange(laps) >= pruned
    other_laps = ~np.isin(np.arange(laps), chosen)

    def add(label: str, rows: NDArray[np.bool_], columns: NDArray[np.bool_]) -> None:
        cells = np.outer(rows & later, columns)
        if cells.any():
            owners[cells] = len(labels)
            labels.append(label)

    for lap in chosen:
        for j in features:
            add(f"{players[j].label}, lap {lap + 1}", np.arange(laps) == lap, owner == j)
        add(f"the rest, lap {lap + 1}", np.arange(laps) == lap, ~np.isin(owner, features))
    for j in features:
        add(f"{players[j].label}, other laps", other_laps, owner == j)
    add("the rest, other laps", other_laps, ~np.isin(owner, features))
    return Cells(tuple(labels), owners)


def prune(agent: NetworkAgent, state: Floats, references: Floats, weights: Doubles, tolerance: float = TOLERANCE) -> int:
    """How many of the oldest laps hardly count, by temporal coalition pruning (Bento et al., 2021, algorithm 1).

    Two players, the laps up to i and those after it, from the newest i back: phi(old) = 1/2 [v(old) - v() + v(all) - v(new)]. The first i
    with |phi(old)| under the tolerance ends the scan, and laps 1 to i become one player.

    Args:
        state, references: as `ValueFunction`'s, [T, F] and [K, T, F].
        weights: of the four calls in the value explained, float64 [4].
        tolerance: share of |v(all) - v()|.
    """
    laps = len(state)
    v = ValueFunction(agent, state, references, event_level(laps, state.shape[1], 0).owners, laps)
    old = np.tri(laps - 1, laps, dtype=np.bool_)  # row i - 1: laps 1 to i
    values = v(np.concatenate([old, ~old, np.zeros((1, laps), np.bool_), np.ones((1, laps), np.bool_)])) @ weights
    empty, full = values[-2:]
    phi = (values[: laps - 1] - empty + full - values[laps - 1 : -2]) / 2
    small = np.flatnonzero(np.abs(phi) < tolerance * abs(full - empty))
    return int(small[-1]) + 1 if len(small) else 0


def _pruned_label(pruned: int) -> tuple[str, ...]:
    return () if not pruned else ("lap 1, pruned",) if pruned == 1 else (f"laps 1 to {pruned}, pruned",)
