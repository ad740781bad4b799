"""Makes learners from their settings; the only module that knows every kind of agent."""

from typing import Any

from rsrl.agents.config import AGENTS, CONFIGS, LearnerConfig
from rsrl.agents.interface import Learner
from rsrl.errors import RsrlError


def default_config(kind: str) -> LearnerConfig:
    """The default settings of an agent; raises RsrlError where the name is unknown."""
    if kind not in CONFIGS:
        raise RsrlError(f"unknown agent {kind!r}; known agents: {', '.join(AGENTS)}")
    return CONFIGS[kind]()  # type: ignore[call-arg]


def make_learner(config: LearnerConfig, environment: Any, seed: int) -> Learner:
    """A new learner of the settings' kind; imports JAX. Raises RsrlError where the environment shows another feature set."""
    if environment.feature_set != config.feature_set:
        raise RsrlError(f"{config.kind} learns on the {config.feature_set!r} features, the environment gives {environment.feature_set!r}")
    from rsrl.agents.dqn import DqnLearner
    from rsrl.agents.drqn import DrqnLearner
    from rsrl.agents.rsrl import RsrlLearner

    kinds: tuple[type[Learner], ...] = (DqnLearner, DrqnLearner, RsrlLearner)
    return {learner.kind: learner for learner in kinds}[config.kind](config, environment, seed)
