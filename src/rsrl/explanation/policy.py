"""The policy under explanation: an agent with its name and hash, evaluated on many states at once."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import ModelMetadata, NetworkAgent, load_agent
from rsrl.explanation.moment import Moment
from rsrl.explanation.result import Decision
from rsrl.season import RaceRecord
from rsrl.state import ACTION_NAMES, Encoder
from rsrl.strategists import PolicyStrategist, find_model, outside_training, weights_hash

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class ExplainedPolicy:
    """A policy to be explained.

    Attributes:
        agent, about: the network and the metadata of its model file.
        name: as the user typed it.
        folder: of the model.
        hash: first 16 hex digits of the SHA-256 of its weights; a tree of the policy is stored under it.
    """

    agent: NetworkAgent
    about: ModelMetadata
    name: str
    folder: Path
    hash: str

    @property
    def recurrent(self) -> bool:
        """Whether the network has a memory of the laps before."""
        return self.agent.network.memory_size > 0

    def encoder(self, record: RaceRecord) -> Encoder:
        """The encoder from raw rows to the policy's input, for one race."""
        return Encoder(self.agent.feature_set, record.scaling)

    def strategist(self, record: RaceRecord) -> PolicyStrategist:
        """The policy as a strategist."""
        return PolicyStrategist(self.agent, record, self.name)

    def q_of_rows(self, features: Floats) -> Floats:
        """Values [N, 4] of encoded rows [N, F], each with an empty memory."""
        return self.agent.q_values(features, self.agent.initial_memory(len(features)))[0]

    def q_of_sequences(self, features: Floats) -> Floats:
        """Values [N, 4] of the last lap of encoded sequences [N, T, F], starting from an empty memory."""
        if not self.recurrent:
            return self.q_of_rows(features[:, -1])
        memory = self.agent.initial_memory(len(features))
        for t in range(features.shape[1]):
            q, memory = self.agent.q_values(features[:, t], memory)
        return q

    def q(self, moment: Moment) -> Floats:
        """Values [4] of the calls at a moment."""
        return self.q_of_sequences(self.encoder(moment.record)(moment.raw)[None])[0]

    def chosen(self, q: Floats, legal: NDArray[np.bool_]) -> NDArray[np.int8]:
        """Greedy calls int8 [N] from values [N, 4] and legal calls [N, 4]; an agent without an action mask may make an illegal call."""
        return np.where(legal | (not self.agent.masked), q, -np.inf).argmax(axis=1).astype(np.int8)

    def decide(self, moment: Moment) -> Decision:
        """The policy's decision at a moment."""
        q = self.q(moment)
        call = int(self.chosen(q[None], moment.legal[None])[0])
        others = [a for a in range(4) if a != call and moment.legal[a]]
        return Decision(
            model=self.name,
            model_hash=self.hash,
            race=moment.record.name,
            driver=moment.driver,
            lap=moment.lap,
            call=ACTION_NAMES[call],
            alternative=ACTION_NAMES[max(others, key=lambda a: float(q[a]))] if others else "",
            q_values={name: float(value) for name, value in zip(ACTION_NAMES, q, strict=True)},
            legal=tuple(ACTION_NAMES[a] for a in range(4) if moment.legal[a]),
            warnings=tuple(outside_training(self.about, moment.record, moment.car)),
        )


def load_explained(model: str) -> ExplainedPolicy:
    """A shipped policy by name, or one by the path of a run folder. Raises RsrlError if there is none."""
    folder = find_model(model)
    agent, about = load_agent(folder)
    return ExplainedPolicy(agent, about, model, folder, weights_hash(agent))
