"""Reset, step, legal actions and the paper's reward; vectorised, and with Gymnasium faces."""

from rsrl.environment.race_environment import Observation, Outcome, RaceEnvironment, Transition
from rsrl.environment.scaling import with_scaling

__all__ = ["Observation", "Outcome", "RaceEnvironment", "Transition", "with_scaling"]
