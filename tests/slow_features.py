"""The features of a state once more, in plain Python from their definitions: slow, and written without a look at the compiled code."""

from functools import lru_cache

from rsrl.season import COMPOUNDS, GRAND_PRIX, RaceRecord
from rsrl.state import CarState, UnifiedRaceState

NONE_S = 100.0
CAP_S = 60.0
IMPOSSIBLE_S = 1e5


class SlowFeatures:
    """Features of a car of a race; `pit_cost_s` by track status."""

    def __init__(self, record: RaceRecord, car: int, pit_cost_s: list[float]) -> None:
        self.record, self.car, self.pit_cost_s = record, car, pit_cost_s
        self.remaining = lru_cache(None)(self._remaining)

    def lap_cost(self, compound: int, age: int) -> float:
        """Seconds of the tyre on a lap."""
        t = self.record.tyres[COMPOUNDS[compound]]
        return t.offset_s.value + t.wear_s_per_lap.value * age + t.curvature_s_per_lap2.value * age**2

    def _remaining(self, lap: int, valid: bool, compound: int, age: int) -> float:
        """Least time to the flag after `lap` laps, alone on the track."""
        if lap == self.record.laps:
            return 0.0 if valid else IMPOSSIBLE_S
        options = [self.remaining(lap + 1, valid, compound, age + 1)]
        if lap + 1 < self.record.laps:
            options += [self.box(lap, valid, compound, new, self.pit_cost_s[0]) for new in range(3)]
        return self.lap_cost(compound, age) + min(options)

    def box(self, lap: int, valid: bool, compound: int, new: int, cost_s: float) -> float:
        """Time to the flag after the coming lap with a stop at its end."""
        cold = self.record.tyres[COMPOUNDS[new]].cold_loss_s.value
        return cost_s + cold + self.remaining(lap + 1, valid or new != compound, new, 0)

    def __call__(self, state: UnifiedRaceState) -> dict[str, float]:
        """All features by name."""
        running = sorted((c for c in state.cars if c.running), key=lambda c: c.position)
        place = next(i for i, c in enumerate(running) if c.driver == state.driver)
        own, ahead, behind = running[place], running[:place][::-1], running[place + 1 :]
        out = self.basics(state, own)
        out |= self.neighbours(state, own, ahead, behind)
        out |= self.stop_now(state, own, ahead, behind)
        out |= self.outlook(state, own)
        out["cars_running"] = len(running)
        return out

    def basics(self, state: UnifiedRaceState, own: CarState) -> dict[str, float]:
        """What concerns the car alone."""
        code = COMPOUNDS.index(own.compound)
        out: dict[str, float] = {
            "track": GRAND_PRIX.index(self.record.grand_prix),
            "safety_car": min(state.track_status, 2),
            "position": own.position,
            "race_progress": state.laps_completed / state.total_laps,
            "tyre": code,
            "tyre_degradation_s": self.lap_cost(code, own.tyre_age_laps) - self.lap_cost(code, 0),
            "gap_to_leader_s": own.gap_to_leader_s,
            "last_lap_ratio": min(own.last_lap_s / self.record.track.base_lap_s.value, 2.0),
            "valid_finish": len(state.compounds_used) > 1,
            "laps_left": state.total_laps - state.laps_completed,
            "tyre_age_laps": own.tyre_age_laps,
            "stops_made": own.stops,
            "safety_car_laps": state.status_laps if state.track_status else 0,
        }
        for name, sets in zip(("soft", "medium", "hard"), state.sets_left, strict=True):
            out |= {f"{name}_available": sets > 0, f"{name}_sets": sets}
        return out

    def neighbours(self, state: UnifiedRaceState, own: CarState, ahead: list[CarState], behind: list[CarState]) -> dict[str, float]:
        """Cars around; nearest first."""
        near_ahead, near_behind = ahead[0] if ahead else own, behind[0] if behind else own
        gap = own.gap_to_leader_s - near_ahead.gap_to_leader_s
        closing = max(min(state.previous_gap_ahead_s, NONE_S) - gap, -NONE_S)
        return {
            "gap_ahead_s": gap if ahead else NONE_S,
            "gap_two_ahead_s": own.gap_to_leader_s - ahead[1].gap_to_leader_s if len(ahead) > 1 else NONE_S,
            "gap_behind_s": near_behind.gap_to_leader_s - own.gap_to_leader_s if behind else NONE_S,
            "gap_two_behind_s": behind[1].gap_to_leader_s - own.gap_to_leader_s if len(behind) > 1 else NONE_S,
            "closing_ahead_s": closing if ahead else 0.0,
            "tyre_age_ahead_laps": near_ahead.tyre_age_laps,
            "tyre_age_behind_laps": near_behind.tyre_age_laps,
            "tyre_ahead": COMPOUNDS.index(near_ahead.compound),
            "tyre_behind": COMPOUNDS.index(near_behind.compound),
            "stops_ahead": near_ahead.stops - own.stops,
            "stops_behind": near_behind.stops - own.stops,
            "stops_to_come_ahead": sum(c.stops - own.stops for c in ahead) / len(ahead) if ahead else 0.0,
        }

    def stop_now(self, state: UnifiedRaceState, own: CarState, ahead: list[CarState], behind: list[CarState]) -> dict[str, float]:
        """What a stop on this lap would cost."""
        cost = self.pit_cost_s[state.track_status]
        back = own.gap_to_leader_s + cost
        gained = [c for c in behind if c.gap_to_leader_s <= back]
        in_front = max(gained, key=lambda c: c.gap_to_leader_s) if gained else (ahead[0] if ahead else None)
        return {
            "pit_cost_s": cost,
            "pit_cost_places": len(gained),
            "rejoin_gap_ahead_s": min(back - in_front.gap_to_leader_s, NONE_S) if in_front else NONE_S,
            "rejoin_gap_behind_s": min([c.gap_to_leader_s - back for c in behind if c not in gained] + [NONE_S]),
            "boxed_ahead": any(c.just_stopped for c in ahead),
            "boxed_behind": any(c.just_stopped for c in behind if c.gap_to_leader_s - own.gap_to_leader_s < cost),
            "cars_in_pit_window": sum(own.gap_to_leader_s - c.gap_to_leader_s <= cost for c in ahead),
        }

    def outlook(self, state: UnifiedRaceState, own: CarState) -> dict[str, float]:
        """Time to the flag of each call beyond the best one's."""
        lap, valid, code = state.laps_completed, len(state.compounds_used) > 1, COMPOUNDS.index(own.compound)
        cost = self.pit_cost_s[state.track_status]
        values = {"stay": self.remaining(lap + 1, valid, code, own.tyre_age_laps + 1)}
        for new, name in enumerate(("soft", "medium", "hard")):
            values[name] = self.box(lap, valid, code, new, cost) if state.sets_left[new] else 1e6
        best = min(values.values())
        return {f"outlook_{name}_s": min(value - best, CAP_S) for name, value in values.items()}
