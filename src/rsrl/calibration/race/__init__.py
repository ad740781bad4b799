"""One race by itself: pace, tyres, traffic, passing, stops, start and incidents of its laps."""
