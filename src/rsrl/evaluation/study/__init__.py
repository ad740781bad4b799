"""Studies: many cells (strategist, race, car), run on this machine or a cluster, and what is made of them."""

from rsrl.evaluation.study.cells import Cell, make_cell, run_cell
from rsrl.evaluation.study.engine import ENGINES, check_engine, run_cells
from rsrl.evaluation.study.store import Store

__all__ = ["ENGINES", "Cell", "Store", "check_engine", "make_cell", "run_cell", "run_cells"]
