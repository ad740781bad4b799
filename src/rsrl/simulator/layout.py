"""Rows and columns of the flat arrays of a race.

A race's changing state is three arrays: `f` float32 [F_ROWS, CARS] and `k` int32 [K_ROWS, CARS] by car, `r` int32 [R_SIZE] of the race.
A field of fewer cars leaves the last slots empty: they stand at the end of the order as if retired before the start.
Parameters never change during a race; they stand in `Figures` (figures.py). Prefixes: F_, K_, R_ state; T_ track, C_ car, Y_ tyre,
I_ whole-number parameters; P_ plan table. "Scratch" rows hold values within one lap only.
"""

from typing import Final

from rsrl.season import MAX_CARS

CARS: Final = MAX_CARS  # three vectors of eight; loops over the cars of the race alone would not be vectorised

# f: per car, float32
F_TIME: Final = 0  # race time at the last line crossing, relative to the race's reference clock, s
F_LAP: Final = 1  # last lap time, s; while a lap is computed, relative to the reference lap
F_WEAR: Final = 2  # tyre wear: effective age, laps (laps under a safety car count less)
F_OFFSET: Final = 3  # of the set fitted: lap time lost fresh (s), per lap of wear (s), and per lap of wear squared (s)
F_LINEAR: Final = 4
F_QUADRATIC: Final = 5
F_COLD: Final = 6  # loss on the next lap because the tyres are cold, s
F_PACE: Final = 7  # pace in this race: car, driver and the day's form, s
F_RAW: Final = 8  # scratch: this lap's time in free air, relative to the reference lap, s; before that, log-odds of boxing
F_GAP: Final = 9  # gap to the car ahead at the start of the lap, s
F_DUE: Final = 10  # part of the last stop's loss that the out-lap's time will show, s
F_USE: Final = 11  # factor on the laps that reactive rivals take a set to have run: 1 as usual, the same for all cars of a race
# rows 12 to 17: inferred from lap times (pace_posterior.py), where a car is called from outside
F_SHOWN_SUM: Final = 12  # sum of surprises on this set, s
F_SHOWN_LAPS: Final = 13  # laps in that sum
F_FORM_SUM: Final = 14  # mean surprises on the sets before, weighted by precision
F_FORM_WEIGHT: Final = 15  # sum of those precisions, 1 / s squared
F_FORM: Final = 16  # posterior mean of the car's form of the day, s
F_LUCK: Final = 17  # posterior mean of the random pace of its set, s
F_ROWS: Final = 18

# k: per car, int32
K_ORDER: Final = 0  # K_ORDER[p]: the car in place p, the leader is place 0
K_PLACE: Final = 1  # K_PLACE[car]: its place
K_COMPOUND: Final = 2
K_AGE: Final = 3  # laps that this set has run, those before the race included
K_STOPS: Final = 4
K_USED: Final = 5  # bit mask of compounds used
K_SOFT_SETS: Final = 6  # sets left, the fitted one not counted; medium and hard follow
K_RETIRE: Final = 9  # lap on which the car stops for good, beyond the flag if it does not
K_PLAN: Final = 10  # row of the plan table; -1: none, called from outside
K_NEXT: Final = 11  # lap of the next planned stop, NO_STOP if none
K_POINTER: Final = 12  # planned stops made
K_STOPPED: Final = 13  # 1 where the car stopped at the end of the last lap
K_WANT: Final = 14  # scratch: compound to box for at the end of this lap, -1 to stay out
K_BITS: Final = 15  # scratch, in this order: random bits of the calls, of the lap's noise, places at the lap's start
K_CALLER: Final = 16  # who decides the car's stops: PLANNED, CALLED or REACTIVE
K_BOX: Final = 17  # scratch: list of the cars that boxed on the last lap; later, of those that box on this one
K_AGE_CELL: Final = 18  # scratch: index into `RivalTables.age`
K_FLAG_CELL: Final = 19  # scratch: index into `RivalTables.reach`
K_BEFORE: Final = 20  # laps that this set had run when it was fitted
K_ROWS: Final = 21

# codes in `callers`, who decides each car's stops; any other code is a row of the plan table
RIVAL: Final = -1  # a plan drawn from those that teams ran
OUTSIDE: Final = -2  # actions come from outside, lap by lap
IMITATION: Final = -3  # a drawn plan gives the starting tyre; each lap is decided as teams decided

# values of K_CALLER
PLANNED: Final = 0  # the plan of row K_PLAN, drawn or given
CALLED: Final = 1  # actions from outside
REACTIVE: Final = 2  # rivals.py

# r: per race, int32
R_LAP: Final = 0  # laps completed
R_STATUS: Final = 1  # track status of the coming lap
R_LEFT: Final = 2  # laps for which the status still lasts, the coming one included
R_SINCE: Final = 3  # laps since the status began, 0 on its first lap
R_RUNNING: Final = 4  # cars running: places 0 to R_RUNNING - 1 of K_ORDER
R_RETIREMENT: Final = 5  # lap of the next retirement of any car
R_KEY0: Final = 6  # the race's random key
R_KEY1: Final = 7
R_CLOCK_MS: Final = 8  # reference clock, ms
R_SC_LAPS: Final = 9  # laps run behind the safety car so far
R_VSC_LAPS: Final = 10
R_FLAGGED: Final = 11  # 1 after the chequered flag
R_NO_DRS: Final = 12  # laps for which DRS is still off, the coming one included
R_RESTART: Final = 13  # 1 if the coming lap begins with a standing restart after a red flag
R_SCRIPTED: Final = 14  # 1 if the race replays a script: classified as it finished, without the two-compound rule
R_RED_LAPS: Final = 15
R_WATCHED: Final = 16  # 1 if form and set pace are inferred from lap times, which whoever calls a car from outside may see
R_OUT: Final = 17  # cars that retired on the lap under way; 0 between laps
R_DISQUALIFIED: Final = 18  # bit mask of cars: whose place a script takes away after the flag
R_SIZE: Final = 19

# track figures, float32
(
    T_BASE,
    T_FUEL,  # s per lap of fuel on board
    T_START,
    T_START_SD,
    T_DRS,
    T_DRS_WINDOW,
    T_DIRTY,
    T_DIRTY_WINDOW,
    T_FOLLOW,
    T_PASS,
    T_PASS_SCALE,
    T_PASS_LOSS,
    T_BLUE,
    T_LAPPING,
    T_PIT,  # green; VSC and SC follow
    T_PIT_VSC,
    T_PIT_SC,
    T_SC_LAP1,
    T_SC,
    T_VSC,
    T_SC_FACTOR,
    T_SC_CATCH,
    T_VSC_FACTOR,
    T_SC_GAP,
    T_WEAR_SC,
    T_WEAR_VSC,
    T_JITTER,
    T_REACT_SC,
    T_REACT_VSC,
    T_STINT,  # spread of a set's random pace, s
    T_EVOLUTION,
    T_PASSED_LOSS,
    T_RED,  # share of safety cars that become a red flag
    T_IN_SHARE,
    T_STACK,
    T_PER_PLACE,  # loss at a standing start, per place
    T_SC_LAP1_ALONE,  # chances of a safety car that comes without a retirement; T_SC_LAP1, T_SC and T_VSC are the totals
    T_SC_ALONE,
    T_VSC_ALONE,
    T_SC_BY_OUT_LAP1,  # chance that a car that retires brings one out
    T_SC_BY_OUT,
    T_VSC_BY_OUT,
    T_PASS_GAP,  # rise of T_PASS with the gap at the start of the lap; 0: the older rule of passing
) = range(43)
T_SIZE: Final = 43

# car figures, float32
C_PACE, C_FORM, C_NOISE, C_START, C_RETIRE, C_STOP, C_LAP1, C_TAIL = range(8)
C_TEAM_FORM: Final = 8  # correlation of the car's form with its team's, the root of the share that team mates have in common
C_ROWS: Final = 9

# tyre figures, float32
Y_OFFSET, Y_LINEAR, Y_QUADRATIC, Y_COLD, Y_LAUNCH = range(5)

# whole-number figures, int32
I_LAPS, I_CARS, I_MAX_LAPS_PER_SET, I_DRS_OFF_LAPS, I_STOPS_ASKED, I_DISQUALIFIED = range(6)

# plan table, int32: stops, start compound, (lap, compound) of each stop, then how far ahead of its lap a stop is taken under SC and VSC
P_STOPS, P_START, P_FIRST = 0, 1, 2
MAX_STOPS: Final = 8
P_SC_WINDOW: Final = P_FIRST + 2 * MAX_STOPS
P_VSC_WINDOW: Final = P_SC_WINDOW + 1
P_COLUMNS: Final = P_VSC_WINDOW + 1
NO_STOP: Final = 1000  # K_NEXT of a car without further planned stops

MIN_STINT_LAPS: Final = 2  # a set fitted fewer laps ago is not changed for a safety car, and no plan puts two stops closer together
