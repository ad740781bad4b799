"""Fits the figures of one Grand Prix to real laps, with standard errors, into a season record."""

from rsrl.calibration.race import CalibrationResult, calibrate_race, figure_table

__all__ = ["CalibrationResult", "calibrate_race", "figure_table"]
