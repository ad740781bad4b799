"""What-if: every option rolled out in the same futures, the policy calling afterwards; and the table of calls under safety cars."""

from rsrl.explanation.from_state import moment_from_state, under_status
from rsrl.explanation.what_if.comparison import Comparison, compare
from rsrl.explanation.what_if.continuation import Continuation
from rsrl.explanation.what_if.explain import explain_what_if
from rsrl.explanation.what_if.options import label, options_at
from rsrl.explanation.what_if.safety_car_table import safety_car_table
from rsrl.explanation.what_if.sentences import plot_time_split, plot_what_if
from rsrl.rollouts import Option

__all__ = [
    "Comparison",
    "Continuation",
    "Option",
    "compare",
    "explain_what_if",
    "label",
    "moment_from_state",
    "options_at",
    "plot_time_split",
    "plot_what_if",
    "safety_car_table",
    "under_status",
]
