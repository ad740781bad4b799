"""How teams decide when to box and for which tyres, fitted to their real decisions.

`decisions` reads them off the laps, `stint_lengths` says what was to be expected before the race, `features` describes each decision as the
compiled race does, `model` fits the odds, `plans` the rivals that drive a plan.
"""

from rsrl.calibration.rivals.decisions import RaceDecisions, race_decisions
from rsrl.calibration.rivals.model import RivalModel, fit_rival_model, rival_figures

__all__ = ["RaceDecisions", "RivalModel", "fit_rival_model", "race_decisions", "rival_figures"]
