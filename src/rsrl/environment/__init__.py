"""Reset, step, legal actions and the paper's reward; vectorised, and with Gymnasium faces (`rsrl/Race-v0`)."""

from rsrl.environment.field import FieldCaller, FieldEnvironment, FieldObserver
from rsrl.environment.gymnasium_face import RaceEnv
from rsrl.environment.gymnasium_vector import RaceVectorEnv
from rsrl.environment.race_environment import Observation, Outcome, RaceEnvironment, Transition
from rsrl.environment.registration import ENV_ID, register_faces
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
    "register_faces",
    "with_scaling",
]

register_faces()
