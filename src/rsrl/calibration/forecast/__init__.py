"""Pace of a race that is not run yet, from earlier races, grid and qualifying."""
