"""The value function of an attribution: action values of a policy that is shown only some players, for many coalitions at once.

    v(S) = mean over references k of Q(x in the cells of the players in S, reference k in all other cells)

The first layer of every network here is linear in its inputs, so its output for a masked state is that for the reference plus one vector
for each player present. The network is therefore folded, once for each reference and lap, into one whose inputs are the players. Players
in which state and reference agree are left out of that reference's game, since their Shapley value is zero, and so are hidden units that no
coalition activates. Values change by rounding alone.
"""

import functools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from rsrl.agents import NetworkAgent
from rsrl.errors import RsrlError

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

SLICE: Final = 2048
"""Coalitions evaluated at once, so few that activations stay in a core's cache."""

MEMORY: Final = "lstm"
"""The layer after the first one in a recurrent network."""


@dataclass(frozen=True)
class Game:
    """The value function of one reference.

    Attributes:
        agent: whose values.
        players: those in which state and reference differ, in the order of the lap on which they first do, int [n].
        first: index of that lap, int [n].
        laps: folded weights of each lap that counts; without memory that is the last one alone.
    """

    agent: NetworkAgent
    players: NDArray[np.int64]
    first: NDArray[np.int64]
    laps: tuple[dict[str, Any], ...]

    def values(self, masks: NDArray[np.bool_]) -> Doubles:
        """Values [M, 4] of coalitions bool [M, n], in the order of `players`."""

        def some(rows: slice) -> Floats:
            present = masks[rows].astype(np.float32)
            memory = self.agent.initial_memory(len(present))
            for weights in self.laps:
                q, memory = self.agent.network.step(weights, present, memory)
            return q

        return np.concatenate(_in_slices(some, len(masks))).astype(np.float64)

    def all_values(self) -> Doubles:
        """Values [2^n, 4] of all coalitions; bit j of an index says whether `players[j]` is present.

        Coalitions that do not differ up to a lap share its evaluation.
        """
        present = coalitions(len(self.players)).astype(np.float32)
        memory = self.agent.initial_memory(1)
        for lap, weights in enumerate(self.laps):
            here = 2 ** int((self.first <= lap).sum())
            memory = np.tile(memory, (here // len(memory), 1))
            q, memory = self._step(weights, present[:here], memory)
        return q.astype(np.float64)

    def _step(self, weights: dict[str, Any], present: Floats, memory: Floats) -> tuple[Floats, Floats]:
        parts = _in_slices(lambda rows: self.agent.network.step(weights, present[rows], memory[rows]), len(present))
        return np.concatenate([q for q, _ in parts]), np.concatenate([m for _, m in parts])


class ValueFunction:
    """Values of the four calls for coalitions of players.

    Args:
        agent: whose values.
        state: encoded laps so far, float32 [T, F]; the last is the decision explained.
        references: inputs that replace those of absent players, float32 [K, T, F].
        owners: player that each cell belongs to, int [T, F].
        count: number of players.

    Attributes:
        games: one for each reference.
    """

    def __init__(self, agent: NetworkAgent, state: Floats, references: Floats, owners: NDArray[np.int64], count: int) -> None:
        if state.shape != owners.shape or references.shape[1:] != state.shape or len(references) < 1:
            raise RsrlError(f"attribution: a state of shape {state.shape} does not go with references of {references.shape}")
        from_lap = 0 if agent.network.memory_size else len(state) - 1
        self.count = count
        with single_blas_thread():
            self.games = tuple(_game(agent, state[from_lap:], r[from_lap:], owners[from_lap:]) for r in references)

    def __call__(self, masks: NDArray[np.bool_]) -> Doubles:
        """Values [M, 4] of coalitions bool [M, count], the mean over references."""
        with single_blas_thread():
            return np.mean([game.values(masks[:, game.players]) for game in self.games], axis=0)


def coalitions(n: int) -> NDArray[np.bool_]:
    """All subsets of n players, bool [2^n, n]; bit j of row i says whether player j is present."""
    return (np.arange(2**n)[:, None] >> np.arange(n) & 1).astype(np.bool_)


def single_blas_thread() -> Any:
    """Context in which matrix products use one thread: slices run in parallel instead, and bits do not depend on the machine."""
    return _blas().limit(limits=1, user_api="blas")


def _game(agent: NetworkAgent, state: Floats, reference: Floats, owners: NDArray[np.int64]) -> Game:
    differs = state != reference
    laps, columns = np.nonzero(differs)
    players, at = np.unique(owners[laps, columns], return_index=True)  # nonzero goes lap by lap, so the first is the earliest
    order = np.argsort(laps[at], kind="stable")
    players, first = players[order], laps[at][order]
    folded = tuple(_folded(agent.params, s, r, o[None] == players[:, None]) for s, r, o in zip(state, reference, owners, strict=True))
    return Game(agent, players, first, folded)


def _folded(params: dict[str, Any], state: Floats, reference: Floats, owned: NDArray[np.bool_]) -> dict[str, Any]:
    """The weights of one lap with the players as inputs; `owned`: whether a column belongs to a player, bool [n, F]."""
    moved = np.where(owned, state.astype(np.float64) - reference, 0.0)
    first = moved @ params["hidden1.weight"]
    start = reference.astype(np.float64) @ params["hidden1.weight"] + params["hidden1.bias"]
    lowest, highest = start + np.minimum(first, 0.0).sum(axis=0), start + np.maximum(first, 0.0).sum(axis=0)
    active = highest > 0.0
    folded = params | {"hidden1.weight": first[:, active].astype(np.float32), "hidden1.bias": start[active].astype(np.float32)}
    if f"{MEMORY}.weight" in params:
        rows = params[f"{MEMORY}.weight"]  # the first layer's units come first, then the memory's
        folded[f"{MEMORY}.weight"] = np.concatenate([rows[: len(active)][active], rows[len(active) :]])
    else:
        rows, bias = params["hidden2.weight"][active], params["hidden2.bias"]
        most = bias + np.maximum(rows, 0.0).T @ highest[active] + np.minimum(rows, 0.0).T @ np.maximum(lowest[active], 0.0)
        kept = most > 0.0
        folded |= {"hidden2.weight": np.ascontiguousarray(rows[:, kept]), "hidden2.bias": bias[kept], "q.weight": params["q.weight"][kept]}
    if "skip.weight" in params:
        folded["skip.weight"] = (moved @ params["skip.weight"]).astype(np.float32)
        folded["q.bias"] = (params["q.bias"] + reference.astype(np.float64) @ params["skip.weight"]).astype(np.float32)
    return folded


def _in_slices(work: Callable[[slice], Any], count: int) -> list[Any]:
    slices = [slice(i, min(i + SLICE, count)) for i in range(0, count, SLICE)]
    return [work(slices[0])] if len(slices) == 1 else list(_workers().map(work, slices))


@functools.cache
def _workers() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="attribution")


@functools.cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()
