"""The features of a state once more, in plain Python from their definitions: slow, and written without a look at the compiled code."""

from functools import lru_cache

import numpy as np

from rsrl.season import COMPOUNDS, GRAND_PRIX, RaceRecord
from rsrl.simulator import compile_figures
from rsrl.state import REGAINED, CarState, UnifiedRaceState, expectation_table, expected_calls_of_rows

NONE_S = 100.0
CAP_S = 60.0
IMPOSSIBLE_S = 1e5


def gap_s(car: CarState) -> float:
    """Gap of a running car to the leader."""
    assert car.gap_to_leader_s is not None
    return car.gap_to_leader_s


class SlowFeatures:
    """Features of a car of a race; `pit_cost_s` by track status."""

    def __init__(self, record: RaceRecord, car: int, pit_cost_s: list[float]) -> None:
        self.record, self.car, self.pit_cost_s = record, car, pit_cost_s
        self.sets = record.sets_of(car)
        self.remaining = lru_cache(None)(self._remaining)
        self.expectation = expectation_table(compile_figures(record), car, regained=REGAINED)
        self.figures = self.known_before()
        self.pace_s = {c.driver: c.pace_s.value for c in record.cars}

    def lap_cost(self, compound: int, age: float | None) -> float:
        """Seconds of the tyre on a lap."""
        t = self.record.tyres[COMPOUNDS[compound]]
        assert age is not None
        return t.offset_s.value + t.wear_s_per_lap.value * age + t.curvature_s_per_lap2.value * age**2

    def _remaining(self, lap: int, valid: bool, compound: int, age: int) -> float:
        """Least time to the flag after `lap` laps, alone on the track; wear beyond the distance counts as at the distance."""
        age = min(age, self.record.laps)
        if lap == self.record.laps:
            return 0.0 if valid else IMPOSSIBLE_S
        options = [self.remaining(lap + 1, valid, compound, age + 1)]
        if lap + 1 < self.record.laps:
            fresh = [laps[0] if laps else 0 for laps in self.sets]
            options += [self.box(lap, valid, compound, new, self.pit_cost_s[0], fresh[new]) for new in range(3)]
        return self.lap_cost(compound, age) + min(options)

    def box(self, lap: int, valid: bool, compound: int, new: int, cost_s: float, age: int = 0) -> float:
        """Time to the flag after the coming lap with a stop at its end, for a set that has run `age` laps."""
        cold = self.record.tyres[COMPOUNDS[new]].cold_loss_s.value
        return cost_s + cold + self.remaining(lap + 1, valid or new != compound, new, age)

    def own_box(self, state: UnifiedRaceState, own: CarState, new: int, impossible_s: float) -> float:
        """Time to the flag with a stop of the own car at the end of the coming lap, for the freshest set of a compound left."""
        left, valid, code = state.sets_left[new], len(state.compounds_used) > 1, COMPOUNDS.index(own.compound)
        if not left:
            return impossible_s
        return self.box(state.laps_completed, valid, code, new, self.pit_cost_s[state.track_status], self.sets[new][-left])

    def __call__(self, state: UnifiedRaceState) -> dict[str, float]:
        """All features by name."""
        running = sorted((c for c in state.cars if c.running), key=lambda c: c.position)
        place = next(i for i, c in enumerate(running) if c.driver == state.driver)
        own, ahead, behind = running[place], running[:place][::-1], running[place + 1 :]
        out = self.basics(state, own)
        out |= self.neighbours(state, own, ahead, behind)
        out |= self.stop_now(state, own, ahead, behind)
        out |= self.outlook(state, own)
        out |= self.field(state, own, ahead, behind)
        out |= self.expected(state, own)
        out |= self.projection(state, own, ahead + behind)
        out |= self.figures
        out["cars_running"] = len(running)
        return out

    def known_before(self) -> dict[str, float]:
        """What track, season and car are like, by the season file."""
        record, own = self.record, self.record.cars[self.car]
        paces = [c.pace_s.value for c in record.cars]
        mean = sum(paces) / len(paces)
        tyres = {name: record.tyres[c] for name, c in (("soft", "S"), ("medium", "M"), ("hard", "H"))}
        plans = [(sum(stop.isdigit() for stop in p.plan.replace("@", "-").split("-")), p.weight) for p in record.rivals.plans]
        out = {f"wear_{name}_s": tyre.wear_s_per_lap.value for name, tyre in tyres.items()}
        return out | {
            "race_laps": record.laps,
            "pit_loss_s": self.pit_cost_s[0],
            "pit_loss_vsc_s": self.pit_cost_s[1],
            "pit_loss_sc_s": self.pit_cost_s[2],
            "offset_soft_s": tyres["soft"].offset_s.value - tyres["medium"].offset_s.value,
            "offset_hard_s": tyres["hard"].offset_s.value - tyres["medium"].offset_s.value,
            "pass_threshold_s": record.track.pass_threshold_s.value,
            "sc_chance": record.incidents.sc_per_lap.value,
            "vsc_chance": record.incidents.vsc_per_lap.value,
            "set_limit_laps": record.max_laps_per_set,
            "rival_stops": sum(stops * weight for stops, weight in plans) / sum(weight for _, weight in plans),
            "grid": own.grid,
            "pace_s": own.pace_s.value - mean,
            "pace_place": sorted(paces).index(own.pace_s.value) + 1,
            "field_spread_s": (sum((p - mean) ** 2 for p in paces) / len(paces)) ** 0.5,
        }

    def basics(self, state: UnifiedRaceState, own: CarState) -> dict[str, float]:
        """What concerns the car alone."""
        code = COMPOUNDS.index(own.compound)
        out: dict[str, float] = {
            "track": GRAND_PRIX.index(self.record.grand_prix),
            "safety_car": min(state.track_status, 2),
            "position": own.position,
            "race_progress": state.laps_completed / state.total_laps,
            "tyre": code,
            "tyre_degradation_s": self.lap_cost(code, own.worn_laps) - self.lap_cost(code, 0),
            "gap_to_leader_s": gap_s(own),
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
        gap = gap_s(own) - gap_s(near_ahead)
        closing = max(min(NONE_S if state.previous_gap_ahead_s is None else state.previous_gap_ahead_s, NONE_S) - gap, -NONE_S)
        return {
            "gap_ahead_s": gap if ahead else NONE_S,
            "gap_two_ahead_s": gap_s(own) - gap_s(ahead[1]) if len(ahead) > 1 else NONE_S,
            "gap_behind_s": gap_s(near_behind) - gap_s(own) if behind else NONE_S,
            "gap_two_behind_s": gap_s(behind[1]) - gap_s(own) if len(behind) > 1 else NONE_S,
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
        back = gap_s(own) + cost
        gained = [c for c in behind if gap_s(c) <= back]
        in_front = max(gained, key=gap_s) if gained else (ahead[0] if ahead else None)
        return {
            "pit_cost_s": cost,
            "pit_cost_places": len(gained),
            "rejoin_gap_ahead_s": min(back - gap_s(in_front), NONE_S) if in_front else NONE_S,
            "rejoin_gap_behind_s": min([gap_s(c) - back for c in behind if c not in gained] + [NONE_S]),
            "boxed_ahead": any(c.just_stopped for c in ahead),
            "boxed_behind": any(c.just_stopped for c in behind if gap_s(c) - gap_s(own) < cost),
            "cars_in_pit_window": sum(gap_s(own) - gap_s(c) <= cost for c in ahead),
        }

    def outlook(self, state: UnifiedRaceState, own: CarState) -> dict[str, float]:
        """Time to the flag of each call beyond the best one's."""
        lap, valid, code = state.laps_completed, len(state.compounds_used) > 1, COMPOUNDS.index(own.compound)
        values = {"stay": self.remaining(lap + 1, valid, code, own.tyre_age_laps + 1)}
        for new, name in enumerate(("soft", "medium", "hard")):
            values[name] = self.own_box(state, own, new, 1e6)
        best = min(values.values())
        return {f"outlook_{name}_s": min(value - best, CAP_S) for name, value in values.items()}

    def field(self, state: UnifiedRaceState, own: CarState, ahead: list[CarState], behind: list[CarState]) -> dict[str, float]:
        """How quick the cars around are, and how many are near, now and after a stop."""
        back = gap_s(own) + self.pit_cost_s[state.track_status]

        def against(car: CarState) -> tuple[float, float]:
            tyre, mine = (self.lap_cost(COMPOUNDS.index(c.compound), c.worn_laps) for c in (car, own))
            shown, own_shown = (self.pace_s[c.driver] + c.form_s + c.set_luck_s for c in (car, own))
            return shown - own_shown, tyre - mine

        out: dict[str, float] = {"form_s": own.form_s, "set_luck_s": own.set_luck_s}
        for side, cars in (("ahead", ahead), ("behind", behind)):
            out[f"pace_{side}_s"], out[f"tyre_loss_{side}_s"] = against(cars[0] if cars else own)
            out[f"cars_close_{side}"] = sum(abs(gap_s(c) - gap_s(own)) < 5.0 for c in cars)
        out["cars_at_rejoin"] = sum(0.0 <= back - gap_s(c) < 4.0 for c in ahead + behind)
        return out

    def expected(self, state: UnifiedRaceState, own: CarState) -> dict[str, float]:
        """Expected time to the flag of each call beyond the best one's, by the table itself (its own test is by plain recursion)."""
        used = sum(1 << COMPOUNDS.index(c) for c in state.compounds_used)
        lap, status, code, mask = (
            np.array([n], np.int32) for n in (state.laps_completed, state.track_status, COMPOUNDS.index(own.compound), used)
        )
        worn = own.tyre_age_laps if self.record.max_laps_per_set else own.worn_laps
        age, values = np.array([worn], np.float32), np.zeros((1, 4), np.float32)
        expected_calls_of_rows(self.expectation, lap, status, np.array([state.sets_left], np.int32), code, age, mask, values)
        best = values[0].min()
        names = ("stay", "soft", "medium", "hard")
        return {f"expected_{name}_s": float(min(value - best, CAP_S)) for name, value in zip(names, values[0], strict=True)}

    def projection(self, state: UnifiedRaceState, own: CarState, others: list[CarState]) -> dict[str, float]:
        """Place at the flag, everybody alone on the track with the best stops, and what each stop of the car's own changes in it."""
        lap, code, cost = state.laps_completed, COMPOUNDS.index(own.compound), self.pit_cost_s[state.track_status]
        left, valid = state.total_laps - lap, len(state.compounds_used) > 1

        def driven(car: CarState) -> float:
            tyre = self.lap_cost(COMPOUNDS.index(car.compound), car.tyre_age_laps)
            return gap_s(car) + (self.pace_s[car.driver] + car.form_s) * left + tyre

        def rival(car: CarState) -> float:
            fitted, two = COMPOUNDS.index(car.compound), car.stops > 0
            options = [self.remaining(lap + 1, two, fitted, car.tyre_age_laps + 1)]
            if state.track_status and left > 1:
                options += [self.box(lap, two, fitted, new, cost) for new in range(3)]
            return driven(car) + min(options)

        def place(to_flag_s: float) -> float:
            lead = [(driven(own) + to_flag_s - rival(car)) / (1.5 + 0.12 * left) for car in others]
            return 1 + sum(0.5 + 0.5 * x / (1 + abs(x)) for x in lead)

        stay = place(self.remaining(lap + 1, valid, code, own.tyre_age_laps + 1))
        out = {"projected_place": stay}
        for new, name in enumerate(("soft", "medium", "hard")):
            out[f"projected_{name}_places"] = place(self.own_box(state, own, new, IMPOSSIBLE_S)) - stay
        return out
