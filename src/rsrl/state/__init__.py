"""The race as every source describes it and every policy reads it: state, strategy, features, scaling."""

from rsrl.state.encoding import Encoder, fit_scaling
from rsrl.state.expectation import REGAINED, Expectation, expectation_table, expected_calls_of_rows
from rsrl.state.features import COLUMN, FEATURE_SETS, FEATURES, FIGURES, NO_CAR_GAP_S, RAW_SIZE, Feature, feature_set, input_names
from rsrl.state.outlook import expected_stop_s, outlook_table
from rsrl.state.race_context import RaceContext, context_figures
from rsrl.state.race_state import CarState, Observer, UnifiedRaceState, UnifiedRaceStrategy
from rsrl.state.vocabulary import ACTION_NAMES, Action

__all__ = [
    "ACTION_NAMES",
    "COLUMN",
    "FEATURES",
    "FEATURE_SETS",
    "FIGURES",
    "NO_CAR_GAP_S",
    "RAW_SIZE",
    "REGAINED",
    "Action",
    "CarState",
    "Encoder",
    "Expectation",
    "Feature",
    "Observer",
    "RaceContext",
    "UnifiedRaceState",
    "UnifiedRaceStrategy",
    "context_figures",
    "expectation_table",
    "expected_calls_of_rows",
    "expected_stop_s",
    "feature_set",
    "fit_scaling",
    "input_names",
    "outlook_table",
]
