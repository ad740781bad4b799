"""Hand-written pit-wall rules with randomised decisions: a stand-in for the rule-based models that teams run.

Each lap, a stop for each available compound is compared with staying out, in seconds to the flag. The clean-air outlook covers tyre wear
and the cost of the stop, cheap stops under a safety car included. The rules add what it leaves out: traffic at the rejoin, places lost,
being held up, undercuts by and against the car, and the option value of waiting for a safety car. A stop is made with a probability that
is logistic in its gain.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.rollouts.hashing import uniform
from rsrl.season import GREEN, SC, RaceRecord
from rsrl.state import COLUMN
from rsrl.strategists.interface import Strategist, column, coming_lap, made_legal

OUTLOOK: Final = slice(COLUMN["outlook_soft_s"], COLUMN["outlook_hard_s"] + 1)
ILLEGAL_S: Final = 1.0e6


@dataclass(frozen=True)
class HeuristicRules:
    """The constants, in seconds to the flag unless a unit is given; positive values favour stopping now."""

    green: float = 0.41  # a stop on a green lap
    vsc: float = -0.32  # a stop under a virtual safety car
    sc: float = 5.5  # a stop under a safety car: the field closes up and returns the time lost
    traffic: float = -0.17  # rejoining right behind a car, fading linearly over a gap of `clear_air_s`
    clear_air_s: float = 1.0
    pressed: float = -0.22  # rejoining with a car right behind, fading over the same gap
    place_green: float = -0.1  # for each place that a stop on this lap costs, by track status
    place_vsc: float = -0.11
    place_sc: float = -0.68
    held_up: float = 0.5  # right behind a car, fading linearly over `held_up_s`: a chance to undercut it
    held_up_s: float = 2.7
    threatened: float = 1.0  # right ahead of a car with no more stops made, fading likewise: it may undercut
    covered: float = -0.86  # a car behind, within the cost of a stop, boxed on the last lap: too late to cover it
    released: float = 1.25  # a car still ahead boxed on the last lap: follow it
    soft: float = -0.82  # fitting softs or mediums rather than hards, beyond the outlook
    medium: float = -1.9
    young_laps: float = 5.5  # laps below which a set is not changed on a green lap
    logistic_scale_s: float = 0.08  # gain over which the odds of stopping grow by a factor of e


class HeuristicStrategist(Strategist):
    """Calls by `HeuristicRules`.

    The default constants were tuned on races of seed 1,000,003 for the default car of Bahrain 2023 and rounded (`strategists.tuning`).
    """

    name = "heuristic"

    def __init__(self, record: RaceRecord, car: int, seed: int, rules: HeuristicRules | None = None) -> None:
        self._own_seed = seed
        self.rules = rules or HeuristicRules()

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Note seeds and numbers of the races."""
        self._seeds, self._races = (self._own_seed, seed), races

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """Box for the best compound with a probability that rises with its gain."""
        legal = environment.legal
        gains = self.stop_gain_s(environment)
        compound = gains.argmax(axis=1)
        gain = gains[np.arange(len(compound)), compound]
        draw = uniform(self._seeds, self._races, coming_lap(environment))
        box = draw < 1 / (1 + np.exp(np.clip(-gain / self.rules.logistic_scale_s, -60.0, 60.0)))
        return made_legal(np.where(box | ~legal[:, 0], compound + 1, 0).astype(np.int8), legal)

    def stop_gain_s(self, environment: RaceEnvironment) -> NDArray[np.float64]:
        """Gain in s of a stop for each compound over staying out, float64 [B, 3]; hugely negative where it is illegal."""
        rules = self.rules
        status = column(environment, "safety_car").astype(np.int64)
        gain = column(environment, "outlook_stay_s")[:, None] - environment.raw[:, OUTLOOK].astype(np.float64)
        gain += np.array([rules.soft, rules.medium, 0.0])
        gain += (self._stop_adjustment_s(environment, status) + np.where(status == GREEN, self._rival_adjustment_s(environment), 0.0))[
            :, None
        ]
        too_young = (status == GREEN) & (column(environment, "tyre_age_laps") < rules.young_laps) & environment.legal[:, 0]
        return np.where(environment.legal[:, 1:] & ~too_young[:, None], gain, -ILLEGAL_S)

    def _stop_adjustment_s(self, environment: RaceEnvironment, status: NDArray[np.int64]) -> NDArray[np.float64]:
        """Gain of a stop from what the outlook leaves out: waiting, places lost, traffic at the rejoin; s, float64 [B]."""
        rules = self.rules
        wait = np.choose(status, (rules.green, rules.vsc, rules.sc))
        place = np.choose(status, (rules.place_green, rules.place_vsc, rules.place_sc))
        traffic = rules.traffic * proximity(column(environment, "rejoin_gap_ahead_s"), rules.clear_air_s)
        pressed = rules.pressed * proximity(column(environment, "rejoin_gap_behind_s"), rules.clear_air_s)
        places = column(environment, "pit_cost_places").astype(np.float64)
        return wait + place * places + np.where(status == SC, 0.0, traffic + pressed)

    def _rival_adjustment_s(self, environment: RaceEnvironment) -> NDArray[np.float64]:
        """Gain of a stop from undercuts by and against the car, s, float64 [B]."""
        rules = self.rules
        near_ahead = proximity(column(environment, "gap_ahead_s"), rules.held_up_s)
        near_behind = proximity(column(environment, "gap_behind_s"), rules.held_up_s) * (column(environment, "stops_behind") <= 0)
        covered = rules.covered * column(environment, "boxed_behind") + rules.released * column(environment, "boxed_ahead")
        return rules.held_up * near_ahead + rules.threatened * near_behind + covered.astype(np.float64)


def proximity(gap_s: NDArray[np.float32], window_s: float) -> NDArray[np.float64]:
    """1 at a gap of zero, falling linearly to 0 at `window_s`."""
    result: NDArray[np.float64] = np.clip(1.0 - gap_s.astype(np.float64) / window_s, 0.0, 1.0)
    return result
