"""Studies: many cells (strategist, race, car), run on this machine or a cluster, and their evaluation."""

from rsrl.evaluation.study.cells import Cell, make_cell, run_cell
from rsrl.evaluation.study.engine import ENGINES, check_engine, run_cells
from rsrl.evaluation.study.entrants import default_strategists, first_race_apart, make_entrants, trained_races
from rsrl.evaluation.study.figure3 import plot_figure3
from rsrl.evaluation.study.generalise import Study, generalise, plan_cells, race_of_track
from rsrl.evaluation.study.scoring import Entrant
from rsrl.evaluation.study.store import Store

__all__ = [
    "ENGINES",
    "Cell",
    "Entrant",
    "Store",
    "Study",
    "check_engine",
    "default_strategists",
    "first_race_apart",
    "generalise",
    "make_cell",
    "make_entrants",
    "plan_cells",
    "plot_figure3",
    "race_of_track",
    "run_cell",
    "run_cells",
    "trained_races",
]
