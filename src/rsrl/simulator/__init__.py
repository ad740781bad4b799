"""The compiled lap-wise Monte Carlo race of up to 24 cars."""

from rsrl.simulator.batch import RaceBatch, Trace, trace_races
from rsrl.simulator.engine import available_cores, run_rows, simulate, simulate_plans
from rsrl.simulator.figures import Figures, compile_figures
from rsrl.simulator.layout import MAX_STOPS
from rsrl.simulator.means import LapMeans, lap_means
from rsrl.simulator.plans import Plan, check_plan
from rsrl.simulator.results import POINTS_BY_POSITION, CarSummary, RaceResults, summarise
from rsrl.simulator.script import Script
from rsrl.simulator.setup import RaceOptions, Rivals

__all__ = [
    "MAX_STOPS",
    "POINTS_BY_POSITION",
    "CarSummary",
    "Figures",
    "LapMeans",
    "Plan",
    "RaceBatch",
    "RaceOptions",
    "RaceResults",
    "Rivals",
    "Script",
    "Trace",
    "available_cores",
    "check_plan",
    "compile_figures",
    "lap_means",
    "run_rows",
    "simulate",
    "simulate_plans",
    "summarise",
    "trace_races",
]
