"""Q-networks and the learners that train them behind one interface: the paper's DQN and DRQN, and RSRL's own.

Calling a race needs NumPy only; JAX is imported when a learner is made.
"""

from rsrl.agents.checkpoint import ModelMetadata, claim_folder, feature_hash, holds_model, load_agent, load_training_state, save_run
from rsrl.agents.config import AGENTS, CONFIGS, DqnConfig, DrqnConfig, LearnerConfig, PaperConfig, RsrlConfig, changed
from rsrl.agents.factory import default_config, make_learner
from rsrl.agents.interface import (
    TRAINING_SEED,
    Agent,
    EnvironmentFactory,
    Learner,
    NetworkAgent,
    TrainingEnvironment,
)
from rsrl.agents.training import Budget, Progress, TrainingResult, resume, train

__all__ = [
    "AGENTS",
    "CONFIGS",
    "TRAINING_SEED",
    "Agent",
    "Budget",
    "DqnConfig",
    "DrqnConfig",
    "EnvironmentFactory",
    "Learner",
    "LearnerConfig",
    "ModelMetadata",
    "NetworkAgent",
    "PaperConfig",
    "Progress",
    "RsrlConfig",
    "TrainingEnvironment",
    "TrainingResult",
    "changed",
    "claim_folder",
    "default_config",
    "feature_hash",
    "holds_model",
    "load_agent",
    "load_training_state",
    "make_learner",
    "resume",
    "save_run",
    "train",
]
