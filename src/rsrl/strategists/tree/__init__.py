"""A decision tree as a strategist."""
