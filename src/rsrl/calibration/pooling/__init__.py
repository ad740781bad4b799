"""Figures of single races pooled over tracks, seasons, teams and C-numbers."""
