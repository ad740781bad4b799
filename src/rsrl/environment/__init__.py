"""The reinforcement-learning environment: reset, step, legal actions, the paper's reward (reward.py).

Races run side by side in one compiled call a lap. `import rsrl` registers it with Gymnasium as `rsrl/Race-v0`.
"""

from rsrl.environment.field import FieldCaller, FieldEnvironment, FieldObserver
from rsrl.environment.gymnasium_env import RaceEnv, race_and_car
from rsrl.environment.gymnasium_vector_env import RaceVectorEnv
from rsrl.environment.race_environment import Observation, Outcome, RaceEnvironment, Transition
from rsrl.environment.scaling import with_scaling
from rsrl.registration import ENV_ID

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
    "race_and_car",
    "with_scaling",
]
