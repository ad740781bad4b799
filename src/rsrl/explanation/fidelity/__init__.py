"""Fidelity: how far each way of explaining can be trusted, measured on the policy itself."""

from rsrl.explanation.fidelity.attribution import measure_attribution
from rsrl.explanation.fidelity.counterfactual import measure_counterfactual
from rsrl.explanation.fidelity.tree import measure_tree
from rsrl.explanation.fidelity.what_if import measure_what_if

__all__ = ["measure_attribution", "measure_counterfactual", "measure_tree", "measure_what_if"]
