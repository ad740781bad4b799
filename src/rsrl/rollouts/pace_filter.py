"""What the pit wall learns of every car's pace from its laps: the form of the day, and the deviation of the stint it is on.

A Kalman filter per car on two numbers, form (which stays) and stint (drawn anew with each set). The measurement is the lap time beyond
what the season file expects of car, fuel, tyre, dirty air and DRS. Only laps that show a car's own pace count: racing laps without a stop,
a pass or a blue flag, and not ended right behind another car.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.rollouts.futures import B_PACE, B_PACE_SD, B_STINT, B_STINT_BY_PACE, B_STINT_SD, prior_belief
from rsrl.season import GREEN
from rsrl.simulator import Figures
from rsrl.simulator import layout as at
from rsrl.simulator.tyres import stint_laps

HELD_S: Final = 0.05  # a lap that ends within so much of the least gap was not the car's own
FAR_S: Final = 3.0  # so far behind at the start of a lap, a car is not held up by one that then boxes
NOTHING: Final = 1.0e-9

# rows of what is kept of each car, float64 [S_ROWS, CARS]
S_FORM, S_STINT, S_FORM_VAR, S_BOTH, S_STINT_VAR, S_TIME, S_PLACE = range(7)  # S_TIME, S_PLACE: at the start of the lap
S_ROWS: Final = 7
# of each race, int64: status, restart and laps without DRS of the lap now under way, laps done at the last update
Q_STATUS, Q_RESTART, Q_NO_DRS, Q_LAP = range(4)
Q_SIZE: Final = 4


class PaceFilter:
    """Filters the pace of the cars of a batch of races: call `update` at the start of every lap, from the first on.

    Attributes:
        belief: float32 [B, B_ROWS, CARS] (`rollouts.futures`).
    """

    def __init__(self, figures: Figures, batch: int) -> None:
        self._figures = figures
        self._cars = np.zeros((batch, S_ROWS, at.CARS))
        self._races = np.zeros((batch, Q_SIZE), np.int64)
        self.belief: NDArray[np.float32] = np.repeat(prior_belief(figures)[None], batch, axis=0)

    def update(self, f: NDArray[np.float32], k: NDArray[np.int32], r: NDArray[np.int32]) -> None:
        """Take in the lap just done of every race; state arrays of the batch."""
        update_beliefs(self._figures, f, k, r, self._cars, self._races, self.belief)


@kernel(inline=True)
def begin(fig, s):
    """What is known on the grid."""
    for car in range(at.CARS):
        s[S_FORM, car] = s[S_STINT, car] = s[S_BOTH, car] = 0.0
        s[S_FORM_VAR, car] = np.float64(fig.cars[at.C_FORM, car]) ** 2
        s[S_STINT_VAR, car] = np.float64(fig.track[at.T_STINT]) ** 2


@kernel(inline=True)
def keep(f, k, r, s, q):
    """Remember how the coming lap begins."""
    for car in range(at.CARS):
        s[S_TIME, car] = f[at.F_TIME, car]
        s[S_PLACE, car] = k[at.K_PLACE, car]
    q[Q_STATUS], q[Q_RESTART], q[Q_NO_DRS], q[Q_LAP] = r[at.R_STATUS], r[at.R_RESTART], r[at.R_NO_DRS], r[at.R_LAP]


@kernel(inline=True)
def is_alone(fig, f, k, r, s, car):
    """Whether nobody held a car up, passed it, was passed or lapped on the last lap."""
    base = np.float64(fig.track[at.T_BASE])
    least = np.float64(fig.track[at.T_FOLLOW]) + HELD_S
    mine, before = np.float64(f[at.F_TIME, car]), s[S_TIME, car]
    for p in range(r[at.R_RUNNING]):
        other = k[at.K_ORDER, p]
        if other == car:
            continue
        was_ahead = s[S_PLACE, other] < s[S_PLACE, car]
        gap_before = before - s[S_TIME, other]
        if k[at.K_STOPPED, other] == 1:  # where it crossed the line before its stop is not to be seen
            if was_ahead and gap_before < FAR_S:
                return False
            continue
        gap = mine - np.float64(f[at.F_TIME, other])
        passed = was_ahead != (p < k[at.K_PLACE, car])
        if passed or (was_ahead and gap < least) or np.floor(gap / base) != np.floor(gap_before / base):
            return False
    return True


@kernel(inline=True)
def shows_pace(fig, f, k, r, s, q, car):
    """Whether the last lap shows a car's own pace. Neither an in-lap nor an out-lap does."""
    raced = q[Q_STATUS] == GREEN and q[Q_RESTART] == 0 and r[at.R_LAP] > 1 and k[at.K_PLACE, car] < r[at.R_RUNNING]
    pits = k[at.K_STOPPED, car] == 1 or (stint_laps(k, car) == 1 and k[at.K_STOPS, car] > 0)
    return raced and not pits and is_alone(fig, f, k, r, s, car)


@kernel(inline=True)
def expected_lap_s(fig, f, k, r, q, car):
    """Expected time of the last lap, a racing one, of a car in its mean form on a set of mean pace: `simulator.lap` without noise."""
    t = fig.track
    laps = np.float64(fig.whole[at.I_LAPS])
    to_go = laps - np.float64(r[at.R_LAP])
    wear = np.float64(f[at.F_WEAR, car]) - 1.0
    tyre = fig.tyres[k[at.K_COMPOUND, car]]
    gap = np.float64(f[at.F_GAP, car])
    expected = np.float64(t[at.T_BASE]) + t[at.T_FUEL] * (to_go + 0.5) + t[at.T_EVOLUTION] * to_go / laps
    expected += fig.cars[at.C_PACE, car] + tyre[at.Y_OFFSET] + wear * (tyre[at.Y_LINEAR] + wear * tyre[at.Y_QUADRATIC])
    expected += max(np.float64(t[at.T_DIRTY]) * (1.0 - gap / t[at.T_DIRTY_WINDOW]), 0.0)
    if q[Q_NO_DRS] == 0 and gap < t[at.T_DRS_WINDOW]:
        expected -= t[at.T_DRS]
    return expected


@kernel(inline=True)
def follow(fig, f, k, r, s, q, car):
    """Take in a car's last lap: the Kalman update of (form, stint), seen through their sum."""
    if k[at.K_STOPPED, car] == 1:
        s[S_STINT, car] = s[S_BOTH, car] = 0.0
        s[S_STINT_VAR, car] = np.float64(fig.track[at.T_STINT]) ** 2
        return
    form, stint = s[S_FORM_VAR, car] + s[S_BOTH, car], s[S_STINT_VAR, car] + s[S_BOTH, car]  # covariances with the sum
    variance = form + stint + np.float64(fig.cars[at.C_NOISE, car]) ** 2
    if variance <= NOTHING or not shows_pace(fig, f, k, r, s, q, car):
        return
    surprise = np.float64(f[at.F_LAP, car]) - expected_lap_s(fig, f, k, r, q, car) - s[S_FORM, car] - s[S_STINT, car]
    s[S_FORM, car] += form / variance * surprise
    s[S_STINT, car] += stint / variance * surprise
    s[S_FORM_VAR, car] -= form * form / variance
    s[S_BOTH, car] -= form * stint / variance
    s[S_STINT_VAR, car] -= stint * stint / variance


@kernel(inline=True)
def tell(fig, s, belief):
    """Write the belief of a race from what is kept of its cars."""
    for car in range(at.CARS):
        form_sd = np.sqrt(max(s[S_FORM_VAR, car], 0.0))
        by_form = s[S_BOTH, car] / form_sd if form_sd > NOTHING else 0.0
        belief[B_PACE, car] = np.float32(fig.cars[at.C_PACE, car] + s[S_FORM, car])
        belief[B_PACE_SD, car] = np.float32(form_sd)
        belief[B_STINT, car] = np.float32(s[S_STINT, car])
        belief[B_STINT_BY_PACE, car] = np.float32(by_form)
        belief[B_STINT_SD, car] = np.float32(np.sqrt(max(s[S_STINT_VAR, car] - by_form * by_form, 0.0)))


@kernel()
def update_beliefs(fig, f, k, r, cars, races, belief):
    """Compiled part of `PaceFilter.update`."""
    for i in range(f.shape[0]):
        if r[i, at.R_LAP] == 0:
            begin(fig, cars[i])
        elif r[i, at.R_LAP] != races[i, Q_LAP]:  # else the race is over
            for car in range(fig.whole[at.I_CARS]):
                follow(fig, f[i], k[i], r[i], cars[i], races[i], car)
        keep(f[i], k[i], r[i], cars[i], races[i])
        tell(fig, cars[i], belief[i])
