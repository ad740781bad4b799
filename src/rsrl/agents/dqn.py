"""The paper's first model: a feed-forward network trained on single laps of past races."""

from typing import Any, ClassVar

import numpy as np

from rsrl.agents.config import PaperConfig
from rsrl.agents.networks import FeedForward, Network, Params
from rsrl.agents.paper_learner import STEPS_A_CALL, PaperLearner
from rsrl.agents.q_learning import Loss, one_step_targets, squared_errors
from rsrl.agents.replay import Laps

Array = Any


def lap_loss(network: Network, config: PaperConfig, online: Params, target: Params, laps: Laps) -> Array:
    """Mean squared error over laps [B]."""
    targets = one_step_targets(config, laps.reward, network.sequence(target, laps.next_features), laps.ended)
    return squared_errors(network.sequence(online, laps.features), laps.action, targets).mean()


class DqnLearner(PaperLearner):
    """The paper's first model; its settings are in `DqnConfig`."""

    kind: ClassVar[str] = "dqn"
    network_kind = FeedForward

    @property
    def loss(self) -> Loss:
        """`lap_loss`."""
        return lap_loss

    def sample(self, rng: np.random.Generator) -> Laps:
        """See `PaperLearner.sample`."""
        return self.replay.sample_laps(rng, (STEPS_A_CALL, self.config.batch))
