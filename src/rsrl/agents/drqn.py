"""The paper's DRQN: its DQN with an LSTM, trained on random sequences from past races (Hausknecht and Stone, 2015)."""

from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.config import DrqnConfig, PaperConfig
from rsrl.agents.dqn import PaperLearner, clipped_errors, descend, one_step_targets
from rsrl.agents.jax_setup import jax, jnp
from rsrl.agents.networks import Lstm, Network, Params
from rsrl.agents.replay import Laps

Array = Any


class DrqnLearner(PaperLearner):
    """The paper's final model; its settings are in `DrqnConfig`."""

    kind: ClassVar[str] = "drqn"
    network_kind = Lstm

    def gradient_step(self, rng: np.random.Generator) -> None:
        """One step on sequences sampled from the replay buffer ("bootstrapped random updates")."""
        assert isinstance(self.config, DrqnConfig)
        self.apply(_sequence_step, *self.replay.sample_sequences(rng, self.config.batch, self.config.sequence_laps))


def sequence_targets(network: Network, config: PaperConfig, target: Params, laps: Laps) -> Array:
    """One-step targets [L, B] of sequences of L laps, by the target network `target` from a zero state."""
    # Within a sequence, the observation after lap t is the one before lap t + 1, so one pass evaluates all successors.
    seen = jnp.concatenate([laps.features[:1], laps.next_features])
    return one_step_targets(config, laps.reward, network.sequence(target, seen)[1:], laps.ended)


@partial(jax.jit, static_argnums=(0, 1))
def _sequence_step(
    network: Network, config: PaperConfig, params: Params, target: Params, optimiser: Any, laps: Laps, counts: NDArray[np.bool_]
) -> tuple[Params, Any]:
    targets = sequence_targets(network, config, target, laps)

    def loss(params: Params) -> Array:
        errors = clipped_errors(config, network.sequence(params, laps.features), laps.action, targets)
        return jnp.sum(jnp.where(counts, errors, 0.0)) / counts.sum()

    return descend(config, loss, params, optimiser)
