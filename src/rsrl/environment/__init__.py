"""The reinforcement-learning environment: reset, step, legal actions, the paper's reward (reward.py).

Races run side by side in one compiled call a lap. For Gymnasium it is registered as `rsrl/Race-v0`.
"""

from rsrl.environment.field import FieldCaller, FieldEnvironment, FieldObserver
from rsrl.environment.gymnasium_env import RaceEnv
from rsrl.environment.gymnasium_vector_env import RaceVectorEnv
from rsrl.environment.race_environment import Observation, Outcome, RaceEnvironment, Transition
from rsrl.environment.registration import ENV_ID, register_environments
from rsrl.environment.scaling import with_scaling

__all__ = [
    "ENV_ID",
    "FieldCaller",
    "FieldEnvironment",
    "FieldObserver",
    "Observation",
    "Outcome",
    "RaceEnv",
    "RaceEnvironment",
    "RaceVectorEnv",
    "Transition",
    "register_environments",
    "with_scaling",
]

register_environments()
