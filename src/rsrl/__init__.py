"""RSRL calls a Formula One race: each lap, stay out or box for soft, medium or hard, and why."""

__version__ = "0.2.0"
