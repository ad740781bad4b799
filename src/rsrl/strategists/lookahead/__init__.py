"""Strategists that run the race on before they call it."""
