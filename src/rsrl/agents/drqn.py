"""The paper's DRQN: its DQN with an LSTM, trained on whole past races (Hausknecht and Stone, 2015)."""

from typing import Any, ClassVar

import numpy as np

from rsrl.agents.config import PaperConfig
from rsrl.agents.jax_setup import jnp
from rsrl.agents.networks import Lstm, Network, Params
from rsrl.agents.paper_learner import STEPS_A_CALL, PaperLearner
from rsrl.agents.q_learning import Loss, one_step_targets, squared_errors
from rsrl.agents.replay import Races

Array = Any


def race_targets(network: Network, config: PaperConfig, target: Params, races: Races) -> Array:
    """One-step targets [L, B] of whole races, by the target network's own memory of them."""
    ended = jnp.arange(races.action.shape[0])[:, None] == races.laps - 1
    return one_step_targets(config, races.reward, network.sequence(target, races.features)[1:], ended)


def race_loss(network: Network, config: PaperConfig, online: Params, target: Params, races: Races) -> Array:
    """Mean squared error over the laps driven of races [L, B]."""
    q = network.sequence(online, races.features[:-1])
    errors = squared_errors(q, races.action, race_targets(network, config, target, races))
    driven = jnp.arange(races.action.shape[0])[:, None] < races.laps
    return jnp.sum(jnp.where(driven, errors, 0.0)) / driven.sum()


class DrqnLearner(PaperLearner):
    """The paper's final model; its settings are in `DrqnConfig`."""

    kind: ClassVar[str] = "drqn"
    network_kind = Lstm

    @property
    def loss(self) -> Loss:
        """`race_loss`."""
        return race_loss

    def sample(self, rng: np.random.Generator) -> Races:
        """See `PaperLearner.sample`; "bootstrapped sequential updates" of Hausknecht and Stone."""
        return self.replay.sample_races(rng, STEPS_A_CALL, self.config.batch)
