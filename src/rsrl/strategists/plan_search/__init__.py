"""The best plan before the race, by search, and the strategists that drive plans."""
