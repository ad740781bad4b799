"""How far each way of explaining can be trusted, measured on the policy itself."""

from rsrl.explanation.fidelity.what_if import measure_what_if

__all__ = ["measure_what_if"]
