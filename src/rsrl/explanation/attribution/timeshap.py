"""TimeSHAP's three levels (Bento et al., 2021) as players of one value function: features, events (laps) and cells, with its pruning."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.explanation.attribution.players import Player, column_owners
from rsrl.explanation.attribution.values import Doubles, Floats, ValueFunction

TOLERANCE: Final = 0.025
"""Share of |v(state) - v(background)| under which older laps are pruned; TimeSHAP's 0.025 was of a probability, whose range is 1."""

CELL_LAPS: Final = 3
CELL_FEATURES: Final = 2
"""The most important laps and features that are looked at cell by cell. With what is left of them there are at most
(3 + 1) (2 + 1) + 1 = 13 players, so that all coalitions can be tried."""


@dataclass(frozen=True)
class Cells:
    """Players as sets of cells of the laps so far.

    Attributes:
        labels: name of each player.
        owners: int [T, F], which player each cell of the network input belongs to.
    """

    labels: tuple[str, ...]
    owners: NDArray[np.int64]


def feature_level(name: str, players: Sequence[Player], laps: int) -> Cells:
    """Each player holds its columns on every lap: v(z) = f(D_z X + (I - D_z) B)."""
    return Cells(tuple(p.label for p in players), np.tile(column_owners(name, players), (laps, 1)))


def event_level(laps: int, columns: int, pruned: int) -> Cells:
    """Each lap a player, the first `pruned` of them together: v(z) = f(X D_z + B (I - D_z))."""
    together = _pruned_label(pruned)
    owners = np.maximum(np.arange(laps) - max(pruned - 1, 0), 0)
    labels = (*together, *(f"lap {lap}" for lap in range(pruned + 1, laps + 1)))
    return Cells(labels, np.repeat(owners[:, None], columns, axis=1))


def cell_level(name: str, players: Sequence[Player], laps: int, pruned: int, chosen: Sequence[int], features: Sequence[int]) -> Cells:
    """Cells of the laps `chosen` (indices) and the players `features`; what is left of each lap, of each feature, and of both, together."""
    owner = column_owners(name, players)
    labels, owners = list(_pruned_label(pruned)), np.full((laps, len(owner)), -1)
    owners[:pruned] = 0
    later = np.arange(laps) >= pruned
    told = np.isin(np.arange(laps), chosen)

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
        add(f"{players[j].label}, other laps", ~told, owner == j)
    add("the rest, other laps", ~told, ~np.isin(owner, features))
    return Cells(tuple(labels), owners)


def prune(agent: NetworkAgent, state: Floats, references: Floats, weights: Doubles, tolerance: float = TOLERANCE) -> int:
    """How many of the oldest laps count for next to nothing, by temporal coalition pruning (Bento et al., 2021, algorithm 1).

    Two players, the laps up to i and those after it, from the newest i back: phi(old) = 1/2 [v(old) - v() + v(all) - v(new)]. The first i
    with |phi(old)| under the tolerance ends the scan, and laps 1 to i become one player.

    Args:
        state, references: as `ValueFunction`'s, [T, F] and [K, T, F].
        weights: float64 [4], of the calls in the value explained.
        tolerance: share of |v(all) - v()|.
    """
    laps = len(state)
    v = ValueFunction(agent, state, references, event_level(laps, state.shape[1], 0).owners, laps)
    old = np.tri(laps - 1, laps, dtype=np.bool_)  # row i - 1: laps 1 to i
    values = v(np.concatenate([old, ~old, np.zeros((1, laps), np.bool_), np.ones((1, laps), np.bool_)])) @ weights
    nobody, everybody = values[-2:]
    phi = (values[: laps - 1] - nobody + everybody - values[laps - 1 : -2]) / 2
    small = np.flatnonzero(np.abs(phi) < tolerance * abs(everybody - nobody))
    return int(small[-1]) + 1 if len(small) else 0


def _pruned_label(pruned: int) -> tuple[str, ...]:
    return () if not pruned else ("lap 1, pruned",) if pruned == 1 else (f"laps 1 to {pruned}, pruned",)
