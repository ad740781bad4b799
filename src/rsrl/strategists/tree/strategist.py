"""The strategist that calls with a decision tree."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import load_agent
from rsrl.environment import RaceEnvironment
from rsrl.season import RaceRecord
from rsrl.strategists.interface import Strategist, made_legal
from rsrl.strategists.policy import find_model, weights_hash
from rsrl.strategists.tree.columns import TreeRows
from rsrl.strategists.tree.files import stored_tree
from rsrl.strategists.tree.tree import Tree

DEFAULT_POLICY: Final = "all"
"""The shipped policy whose tree is the strategist `tree`."""


class TreeStrategist(Strategist):
    """Calls with a decision tree; illegal calls are replaced as by `made_legal`."""

    def __init__(self, tree: Tree, name: str = "tree") -> None:
        self.name = name
        self.tree = tree
        self._rows = TreeRows(tree.columns)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start with an empty history."""
        self._rows.begin(len(races))

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The prediction of the leaf that each race reaches, made legal."""
        return made_legal(self.tree.actions(self._rows(environment.raw)), environment.legal)


def default_tree_strategist(record: RaceRecord, car: int) -> TreeStrategist:
    """The strategist `tree`: calls with the stored tree of `DEFAULT_POLICY`. Raises as `stored_tree`."""
    folder = find_model(DEFAULT_POLICY)
    agent, _ = load_agent(folder)
    return TreeStrategist(stored_tree(folder, DEFAULT_POLICY, weights_hash(agent), record, car))
