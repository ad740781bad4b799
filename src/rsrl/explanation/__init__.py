"""Why a policy calls what it calls: one result type for every way of explaining it."""

from rsrl.explanation.attribution import explain_attribution
from rsrl.explanation.moment import Moment, reach
from rsrl.explanation.result import Decision, Explanation
from rsrl.explanation.subject import ExplainedPolicy, load_explained
from rsrl.explanation.summary import drive, summarise_race

__all__ = ["Decision", "ExplainedPolicy", "Explanation", "Moment", "drive", "explain_attribution", "load_explained", "reach", "summarise_race"]
