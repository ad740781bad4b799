"""Rules of the pit wall, with a little chance in them: stands in for the hand-coded model that teams run.

Each lap every stop there are tyres for is weighed against staying out, in seconds to the flag. The clean-air outlook
says what wear and the price of a stop make of it, cheap stops under a safety car included. To that the rules add what
the outlook can't know: traffic at the rejoin, places lost, being held up, undercuts made and feared, and the worth of
waiting for a safety car. A stop is made with a probability that rises from 0 to 1 around an even balance.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.environment import RaceEnvironment
from rsrl.season import GREEN, SC, RaceRecord
from rsrl.state import COLUMN
from rsrl.strategists.hashing import uniform
from rsrl.strategists.interface import Strategist, column, coming_lap, made_legal

OUTLOOK: Final = slice(COLUMN["outlook_soft_s"], COLUMN["outlook_hard_s"] + 1)
NEVER_S: Final = 1.0e6


@dataclass(frozen=True)
class HeuristicRules:
    """The constants, in seconds to the flag unless said otherwise; positive speaks for a stop now."""

    green: float = 0.41  # a stop on a racing lap: fresh tyres are worth a little more than the outlook says
    vsc: float = -0.32  # a stop under a virtual safety car
    sc: float = 5.5  # a stop under a safety car: the queue gives the lost time back
    traffic: float = -0.17  # to rejoin right behind a car, fading linearly over `clear_air_s`
    clear_air_s: float = 1.0
    pressed: float = -0.22  # to rejoin with a car right behind, fading over the same gap
    place_green: float = -0.1  # for each place a stop costs on this lap, by track status
    place_vsc: float = -0.11
    place_sc: float = -0.68
    held_up: float = 0.5  # right behind a car, fading linearly over `held_up_s`: the undercut
    held_up_s: float = 2.7
    threatened: float = 1.0  # right ahead of a car that has made no more stops, fading likewise: its undercut
    covered: float = -0.86  # a car that boxed on the last lap is behind, within the price of a stop: too late to cover it
    released: float = 1.25  # a car still ahead boxed on the last lap: follow it
    soft: float = -0.82  # for fitting softs, against hards, beyond what the outlook says
    medium: float = -1.9
    young_laps: float = 5.5  # no stop on a racing lap for a set that has done fewer laps
    chance_s: float = 0.08  # scale of the logistic from never to always


class HeuristicStrategist(Strategist):
    """Calls by `HeuristicRules`.

    The default constants were tuned (`strategists.tuning`) on races of seed 1,000,003, for the default car of Bahrain 2023,
    and rounded; they were tuned again when the rivals began to react.
    """

    name = "heuristic"

    def __init__(self, record: RaceRecord, car: int, seed: int, rules: HeuristicRules | None = None) -> None:
        self._own_seed = seed
        self.rules = rules or HeuristicRules()

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Remember which races these are."""
        self._seeds, self._races = (self._own_seed, seed), races

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """Box for the best compound where the balance speaks for it."""
        legal = environment.legal
        balance = self.balance_s(environment)
        compound = balance.argmax(axis=1)
        gain = balance[np.arange(len(compound)), compound]
        luck = uniform(self._seeds, self._races, coming_lap(environment))
        box = luck < 1 / (1 + np.exp(np.clip(-gain / self.rules.chance_s, -60.0, 60.0)))
        return made_legal(np.where(box | ~legal[:, 0], compound + 1, 0).astype(np.int8), legal)

    def balance_s(self, environment: RaceEnvironment) -> NDArray[np.float64]:
        """What a stop for each compound gains on staying out, float64 [B, 3]; hugely negative where it is not legal."""
        rules = self.rules
        status = column(environment, "safety_car").astype(np.int64)
        gain = column(environment, "outlook_stay_s")[:, None] - environment.raw[:, OUTLOOK].astype(np.float64)
        gain += np.array([rules.soft, rules.medium, 0.0])
        gain += (self._price(environment, status) + np.where(status == GREEN, self._rivals(environment), 0.0))[:, None]
        too_young = (status == GREEN) & (column(environment, "tyre_age_laps") < rules.young_laps) & environment.legal[:, 0]
        return np.where(environment.legal[:, 1:] & ~too_young[:, None], gain, -NEVER_S)

    def _price(self, environment: RaceEnvironment, status: NDArray[np.int64]) -> NDArray[np.float64]:
        """What the outlook leaves out of a stop's price: waiting, places, traffic at the rejoin."""
        rules = self.rules
        wait = np.choose(status, (rules.green, rules.vsc, rules.sc))
        place = np.choose(status, (rules.place_green, rules.place_vsc, rules.place_sc))
        traffic = rules.traffic * nearness(column(environment, "rejoin_gap_ahead_s"), rules.clear_air_s)
        pressed = rules.pressed * nearness(column(environment, "rejoin_gap_behind_s"), rules.clear_air_s)
        places = column(environment, "pit_cost_places").astype(np.float64)
        return wait + place * places + np.where(status == SC, 0.0, traffic + pressed)

    def _rivals(self, environment: RaceEnvironment) -> NDArray[np.float64]:
        """Undercuts made and feared."""
        rules = self.rules
        near_ahead = nearness(column(environment, "gap_ahead_s"), rules.held_up_s)
        near_behind = nearness(column(environment, "gap_behind_s"), rules.held_up_s) * (column(environment, "stops_behind") <= 0)
        covered = rules.covered * column(environment, "boxed_behind") + rules.released * column(environment, "boxed_ahead")
        return rules.held_up * near_ahead + rules.threatened * near_behind + covered.astype(np.float64)


def nearness(gap_s: NDArray[np.float32], window_s: float) -> NDArray[np.float64]:
    """1 at no gap, falling linearly to 0 at `window_s`."""
    result: NDArray[np.float64] = np.clip(1.0 - gap_s.astype(np.float64) / window_s, 0.0, 1.0)
    return result
