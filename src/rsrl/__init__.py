"""RSRL calls a Formula One race: each lap, stay out or box for soft, medium or hard, and why.

The names below are what a notebook needs. They are imported when first used, so `import rsrl` is quick; it also registers `rsrl/Race-v0`
with Gymnasium. Everything else is in the packages, such as `rsrl.simulator` and `rsrl.explanation`.
"""

from rsrl.registration import register_with_gymnasium

TYPE_CHECKING = False  # as in registration.py
if TYPE_CHECKING:
    from rsrl.api import Simulation, evaluate, explain, load_policy, make_env, plan, simulate
    from rsrl.errors import RsrlError
    from rsrl.season import load_race, race_names
    from rsrl.simulator import Plan

__version__ = "0.2.0"

__all__ = [
    "Plan",
    "RsrlError",
    "Simulation",
    "evaluate",
    "explain",
    "load_policy",
    "load_race",
    "make_env",
    "plan",
    "race_names",
    "simulate",
]

_HOMES = {"Plan": "rsrl.simulator", "RsrlError": "rsrl.errors", "load_race": "rsrl.season", "race_names": "rsrl.season"}
"""Modules of the names that are not of `rsrl.api`."""

if not TYPE_CHECKING:  # a type checker that saw this function would accept any name

    def __getattr__(name):
        """Import a public name when it is first used."""
        if name not in __all__:
            raise AttributeError(f"module 'rsrl' has no attribute {name!r}; there are {', '.join(__all__)}, and the packages in it")
        from importlib import import_module

        globals()[name] = value = getattr(import_module(_HOMES.get(name, "rsrl.api")), name)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


register_with_gymnasium()
