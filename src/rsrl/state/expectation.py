"""The least expected time to the flag with random safety cars, by stochastic dynamic programming after Heine & Thraves (2023).

Lap by lap from the flag back, over the track status of the coming lap, the sets left of each compound, the compound fitted and its age:
what a car alone on the track loses to the reference laps when every later call is the best one for the track status of its lap. The loss
of a stop under each status, the wear that a slow lap saves, and the sets already used are included; traffic is not.

The status changes as in the race itself (simulator/status.py), except for the length of a slow period: it ends with the same probability
on each lap, one over its mean length, because the state does not hold how long it has lasted. Chances are totals over all racing laps:
the state does not hold who retired, and the safety car that a retirement brings out is in the coming lap's status already.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.season import GREEN, RED, SC, VSC
from rsrl.simulator import layout as at
from rsrl.simulator.figures import Figures
from rsrl.simulator.tyres import next_set
from rsrl.state.outlook import IMPOSSIBLE_S, expected_stop_s, lap_cost

REGAINED: Final = 0.4
"""Share of a second lost that a later safety car gives back: chosen on 2,048 races each of seed 1,000,003 at twelve Grands Prix of 2023
(docs/strategists.md). All of it would be too much: a place lost in the queue has to be won back."""

STATUSES: Final = 4
ZERO, ONE = np.float32(0.0), np.float32(1.0)


class Expectation(NamedTuple):
    """The table and what it was filled with.

    Attributes:
        value: least expected time to the flag in s beyond the reference laps, float32 [laps + 1, 4, combinations, 3, laps + 1].
            Indices: laps done, track status of the coming lap, sets left (`combination`), compound fitted, its age in laps.
        move: chance of each status on the next lap, float32 [2, 4, 4]: after lap 1 or a later one, status now, status next.
        counts: share of a second lost that still counts at the flag, float32 [laps + 2, 4] by lap and its status.
        stop_s: mean loss of a stop by status, float32 [4].
        ageing: laps by which a lap ages a set by status, float32 [4].
        tyres: tyre figures, float32 [3, 4].
        sets: of each compound at the start, the first one included, int32 [3].
        laps_before: laps that each set has run before the race, int32 [3, sets]: `Figures.laps_before` of the car.
        max_laps_per_set: 0 for no limit.
        stops_asked: stops that the rules ask for besides a second compound.
    """

    value: NDArray[np.float32]
    move: NDArray[np.float32]
    counts: NDArray[np.float32]
    stop_s: NDArray[np.float32]
    ageing: NDArray[np.float32]
    tyres: NDArray[np.float32]
    sets: NDArray[np.int32]
    laps_before: NDArray[np.int32]
    max_laps_per_set: int
    stops_asked: int


def expectation_table(figures: Figures, car: int, *, regained: float = 0.0) -> Expectation:
    """Fill the table for one car: about a million states in a few milliseconds.

    Args:
        regained: share of a second lost that a later safety car gives back, as the field closes up behind it. With 0 the table is the
            least expected race time; with 1 only what is lost after the last safety car counts.

    Ages are effective laps. Where a set may run so many laps only, they are laps driven, as the limit counts them.
    """
    laps, limit = int(figures.whole[at.I_LAPS]), int(figures.whole[at.I_MAX_LAPS_PER_SET])
    sets = np.ascontiguousarray(figures.sets[:, car])
    move = status_chances(figures)
    t = figures.track
    expectation = Expectation(
        value=np.zeros((laps + 1, STATUSES, int(np.prod(sets + 1)), 3, laps + 1), np.float32),
        move=move,
        counts=(1.0 - regained * closing_up_chances(move, laps)).astype(np.float32),
        stop_s=np.array([expected_stop_s(figures, car, status) for status in range(STATUSES)], np.float32),
        ageing=np.array([1, 1, 1, 1] if limit else [1, t[at.T_WEAR_VSC], t[at.T_WEAR_SC], t[at.T_WEAR_SC]], np.float32),
        tyres=figures.tyres,
        sets=sets,
        laps_before=np.ascontiguousarray(figures.laps_before[:, :, car]),
        max_laps_per_set=limit,
        stops_asked=int(figures.whole[at.I_STOPS_ASKED]),
    )
    _fill(expectation, np.empty(expectation.value.shape[1:], np.float32))
    return expectation


def status_chances(figures: Figures) -> NDArray[np.float32]:
    """Chance of each track status on the next lap, float32 [2, 4, 4]: see `Expectation.move`."""
    t = figures.track.astype(np.float64)
    move = np.zeros((2, STATUSES, STATUSES))
    for row, sc in zip(move, (t[at.T_SC_LAP1], t[at.T_SC]), strict=True):
        row[GREEN] = 1 - sc - t[at.T_VSC], t[at.T_VSC], sc * (1 - t[at.T_RED]), sc * t[at.T_RED]
        for status, cumulative in ((VSC, figures.vsc_laps), (SC, figures.sc_laps)):
            mean_laps = 1 + float((1 - cumulative.astype(np.float64)).sum())
            row[status, status], row[status, GREEN] = 1 - 1 / mean_laps, 1 / mean_laps
        row[RED, GREEN] = 1
    return move.astype(np.float32)


def closing_up_chances(move: NDArray[np.float32], laps: int) -> NDArray[np.float64]:
    """Probability that the field closes up on a later lap, by a safety car or red flag: float64 [laps + 2, 4] by lap and its status."""
    chances = np.zeros((laps + 2, STATUSES))
    for lap in range(laps - 1, 0, -1):
        later = chances[lap + 1].copy()
        later[[SC, RED]] = 1.0
        chances[lap] = move[0 if lap == 1 else 1].astype(np.float64) @ later
    return chances


@kernel(inline=True)
def combination(sets, a, b, c):
    """Index of sets left: a soft, b medium, c hard."""
    return (a * (sets[1] + 1) + b) * (sets[2] + 1) + c


@kernel(inline=True)
def one_less(sets, combo, compound):
    """Index of sets left when one of a compound is fitted; the same where none is left."""
    step = (sets[1] + 1) * (sets[2] + 1) if compound == 0 else (sets[2] + 1 if compound == 1 else 1)
    return combo - (step if (combo // step) % (sets[compound] + 1) > 0 else 0)


@kernel(inline=True)
def set_to_fit(x, left, compound):
    """Laps that the freshest set of a compound has run before the race, of those `left` [3]."""
    return x.laps_before[compound, next_set(x.sets[compound], left[compound], x.laps_before.shape[1])]


@kernel(inline=True)
def fitting_cost(x, lap, status, compound):
    """Expected price of other tyres at the end of `lap`: the stop, and the cold lap that only a racing lap has."""
    green = x.move[0 if lap == 1 else 1, status, GREEN]
    return x.counts[lap, status] * x.stop_s[status] + x.counts[lap + 1, GREEN] * green * x.tyres[compound, at.Y_COLD]


@kernel(inline=True)
def driving_cost(x, lap, status, compound, age):
    """Cost of the tyre on `lap`: none on a slow one, whose pace the safety car sets. A lap beyond what a set may run is ruled out."""
    cost = x.counts[lap, status] * lap_cost(x.tyres, compound, age) if status == GREEN else ZERO
    return cost + (IMPOSSIBLE_S if x.max_laps_per_set > 0 and age >= x.max_laps_per_set else ZERO)


@kernel(inline=True)
def between(row, age):
    """Value of a row by age at an age between whole laps, linear: the last one beyond its end."""
    last = row.shape[0] - 1
    low = min(int(age), last)
    share = age - np.float32(low) if low < last else ZERO
    return row[low] + share * (row[min(low + 1, last)] - row[low])


@kernel(inline=True)
def _look_ahead(value, move, onward):
    """`onward` [status, combination, compound, age]: expected `value` of the next lap's start, given this lap's status."""
    onward[:] = ZERO
    for status in range(STATUSES):
        for after in range(STATUSES):
            chance = move[status, after]
            if chance == ZERO:
                continue
            for combo in range(value.shape[1]):
                for compound in range(3):
                    for age in range(value.shape[3]):
                        onward[status, combo, compound, age] += chance * value[after, combo, compound, age]


@kernel(inline=True)
def _cheapest_stop(x, onward, lap, status, combo, left, used, must):
    """Expected time from the end of `lap` with the best set that may be fitted; IMPOSSIBLE_S where there is none."""
    best = IMPOSSIBLE_S
    if lap < x.value.shape[0] - 1:
        for new in range(3):
            if left[new] > 0 and not (must and (used >> new) & 1):
                after = onward[status, one_less(x.sets, combo, new), new, set_to_fit(x, left, new)]
                best = min(best, fitting_cost(x, lap, status, new) + after)
    return best


@kernel(inline=True)
def _fill_ages(x, row, onward, lap, status, compound, stop, may_stop, must):
    """Best call at every age of the set. `onward` [age] is for staying out, `stop` the value of the best stop."""
    limit = x.max_laps_per_set
    for age in range(row.shape[0]):
        stay = between(onward, np.float32(age) + x.ageing[status])
        best = min(stay, stop) if may_stop else stay
        if (must or (limit > 0 and age + 1 >= limit)) and stop < IMPOSSIBLE_S:
            best = stop
        row[age] = driving_cost(x, lap, status, compound, age) + best


@kernel()
def _fill(x, onward):
    """Fill x.value from the flag back. `onward` [4, combinations, 3, laps + 1] is working memory."""
    laps = x.value.shape[0] - 1
    for lap in range(laps, -1, -1):  # laps done; the coming one is lap + 1
        if lap < laps:
            _look_ahead(x.value[lap + 1], x.move[0 if lap == 0 else 1], onward)
        for a in range(x.sets[0] + 1):
            for b in range(x.sets[1] + 1):
                for c in range(x.sets[2] + 1):
                    left = (a, b, c)
                    combo = combination(x.sets, a, b, c)
                    for compound in range(3):
                        used = (a < x.sets[0]) | ((b < x.sets[1]) << 1) | ((c < x.sets[2]) << 2) | (1 << compound)
                        invalid = (used & (used - 1)) == 0
                        if lap == laps:
                            made = x.sets[0] - a + x.sets[1] - b + x.sets[2] - c - 1  # stops: the set of the start is none
                            x.value[lap, :, combo, compound, :] = IMPOSSIBLE_S if invalid or made < x.stops_asked else ZERO
                            continue
                        must = invalid and lap + 1 >= laps - 1
                        reach = x.max_laps_per_set == 0 or x.max_laps_per_set * (a + b + c) >= laps - lap - 1
                        for status in range(STATUSES):
                            stop = _cheapest_stop(x, onward, lap + 1, status, combo, left, used, must)
                            row = x.value[lap, status, combo, compound]
                            _fill_ages(x, row, onward[status, combo, compound], lap + 1, status, compound, stop, reach, must)


@kernel(inline=True)
def _onward(x, lap, status, combo, compound, age):
    """Expected value of the next lap's start, from the end of `lap`."""
    total = ZERO
    for after in range(STATUSES):
        chance = x.move[0 if lap == 1 else 1, status, after]
        if chance > ZERO:
            total += chance * between(x.value[lap, after, combo, compound], age)
    return total


@kernel(inline=True)
def expected_calls_s(x, lap, status, sets_left, compound, age, used, out):
    """`out` float32 [4]: expected time to the flag of each call for the coming lap, s; IMPOSSIBLE_S and more where it may not be made.

    `x`: an Expectation; `lap` laps done, `status` of the coming lap, `sets_left` [3] without the fitted one, `age` in laps (a fraction is
    fine), `used` bit mask of compounds. Where a source's sets left and compounds used disagree, those used decide about the rule.
    """
    laps = x.value.shape[0] - 1
    coming = lap + 1
    limit = x.max_laps_per_set
    total = sets_left[0] + sets_left[1] + sets_left[2]
    must = coming >= laps - 1 and (used & (used - 1)) == 0
    worn_out = limit > 0 and age + ONE >= limit
    free = coming < laps and (limit == 0 or limit * total >= laps - coming or worn_out or must)
    combo = 0
    for c in range(3):
        known = min(max(sets_left[c], 0), x.sets[c] - 1) if (used >> c) & 1 else x.sets[c]
        combo = combo * (x.sets[c] + 1) + max(known, 0)
    drive = driving_cost(x, coming, status, compound, age)
    found = False
    for c in range(3):
        out[1 + c] = drive + IMPOSSIBLE_S
        if free and sets_left[c] > 0 and not (must and (used >> c) & 1):
            after = _onward(x, coming, status, one_less(x.sets, combo, c), c, np.float32(set_to_fit(x, sets_left, c)))
            out[1 + c] = drive + fitting_cost(x, coming, status, c) + after
            found = True
    out[0] = drive + _onward(x, coming, status, combo, compound, age + x.ageing[status])
    if found and (must or worn_out):
        out[0] = drive + IMPOSSIBLE_S


@kernel()
def expected_calls_of_rows(x, lap, status, sets_left, compound, age, used, out):
    """`expected_calls_s` of n states: lap, status, compound, used int32 [n]; sets_left int32 [n, 3]; age float32 [n]; out [n, 4]."""
    for i in range(lap.shape[0]):
        expected_calls_s(x, lap[i], status[i], sets_left[i], compound[i], age[i], used[i], out[i])
