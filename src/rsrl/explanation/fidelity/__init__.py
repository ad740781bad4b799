"""How far each way of explaining can be trusted, measured against the policy itself."""

from rsrl.explanation.fidelity.attribution import measure_attribution

__all__ = ["measure_attribution"]
