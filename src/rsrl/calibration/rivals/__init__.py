"""How teams call a race, fitted to their real calls."""
