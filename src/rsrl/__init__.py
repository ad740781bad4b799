"""RSRL calls a Formula One race: each lap, stay out or box for soft, medium or hard, and why."""

from rsrl.registration import register_with_gymnasium

__version__ = "0.2.0"

register_with_gymnasium()
