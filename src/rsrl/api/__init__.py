"""The functions of `import rsrl`: what the commands compute, for a notebook.

Arguments have the names of the commands' options, and the same seed gives the same results. A race is given by its name, the path of a
season file or a record; a driver by code, number or surname, None for the race's default driver.
"""

from rsrl.api.policies import DEFAULT_STRATEGISTS, evaluate, explain, load_policy
from rsrl.api.races import Simulation, make_env, plan, simulate

__all__ = [
    "DEFAULT_STRATEGISTS",
    "Simulation",
    "evaluate",
    "explain",
    "load_policy",
    "make_env",
    "plan",
    "simulate",
]
