"""Where everything stands in the flat arrays of a race: the one list of rows and columns.

A race's changing state is three arrays: `f` float32 [F_ROWS, 20], `k` int32 [K_ROWS, 20] and `r` int32 [R_SIZE].
Parameters never change during a race and stand in `Figures` (figures.py).
"""

from typing import Final

CARS: Final = 20

# f: per car, float32
F_TIME: Final = 0  # race time at the last line crossing, relative to the race's reference clock, s
F_LAP: Final = 1  # last lap time, s
F_WEAR: Final = 2  # effective tyre age, laps (slow laps count less)
F_OFFSET: Final = 3  # figures of the tyres fitted
F_LINEAR: Final = 4
F_QUADRATIC: Final = 5
F_COLD: Final = 6  # cold-tyre loss still to come on the next lap, s
F_PACE: Final = 7  # pace in this race: car, driver and the day's form, s
F_RAW: Final = 8  # scratch: this lap's time in free air, relative to the reference lap
F_GAP: Final = 9  # gap to the car ahead one lap earlier, s
F_DUE: Final = 10  # part of the last stop's loss that the next lap's time will show, s
F_USE: Final = 11  # how fast sets are used up in this race, as reactive rivals see it: 1 as usual, the same for all cars
F_SHOWN_SUM: Final = (
    12  # what lap times show of the car, kept where a car is called from outside (pace_watch.py): sum of surprises on this set
)
F_SHOWN_LAPS: Final = 13  # and how many
F_FORM_SUM: Final = 14  # surprises on the sets before, weighted by precision, and the precision
F_FORM_WEIGHT: Final = 15
F_FORM: Final = 16  # what is believed of the car's form of the day, s
F_LUCK: Final = 17  # and of the luck of its set, s
F_ROWS: Final = 18

# k: per car, int32
K_ORDER: Final = 0  # K_ORDER[p]: the car in place p, the leader is place 0
K_PLACE: Final = 1  # K_PLACE[car]: its place
K_COMPOUND: Final = 2
K_AGE: Final = 3  # laps on this set
K_STOPS: Final = 4
K_USED: Final = 5  # bit mask of compounds used
K_SOFT_SETS: Final = 6  # sets left, the fitted one not counted; medium and hard follow
K_RETIRE: Final = 9  # lap on which the car stops for good, beyond the flag if it does not
K_PLAN: Final = 10  # row of the plan table, -1: none, called from outside
K_NEXT: Final = 11  # lap of the next planned stop
K_POINTER: Final = 12  # planned stops taken
K_STOPPED: Final = 13  # 1 where the car stopped at the end of the last lap
K_WANT: Final = 14  # scratch: compound to box for at the end of this lap, -1 none
K_BITS: Final = 15  # scratch: random bits of this lap's noise; before that, of its calls; after it, places at its start
K_CALLER: Final = 16  # who calls the car: PLANNED, CALLED or REACTIVE
K_BOX: Final = 17  # scratch: the cars that box at the end of this lap; before that, those that did on the last
K_AGE_CELL: Final = 18  # scratch: where a car's laps on its set stand in `RivalTables.age`
K_FLAG_CELL: Final = 19  # scratch: where its laps on the set at the flag stand in `RivalTables.reach`
K_ROWS: Final = 20

# caller codes of a race's `callers`; any other is a row of the plan table
RIVAL: Final = -1  # a plan drawn from what teams ran
OUTSIDE: Final = -2  # actions come from outside, lap by lap
IMITATION: Final = -3  # a drawn plan says how to start and what is intended; each lap is decided as teams decided

# K_CALLER
PLANNED: Final = 0  # the plan of row K_PLAN, drawn or given
CALLED: Final = 1  # from outside
REACTIVE: Final = 2  # rivals.py

# r: per race, int32
R_LAP: Final = 0  # laps completed
R_STATUS: Final = 1  # track status of the coming lap
R_LEFT: Final = 2  # laps the status still lasts, the coming one included
R_SINCE: Final = 3  # laps since the status began, 0 on its first lap
R_RUNNING: Final = 4  # cars running
R_RETIREMENT: Final = 5  # lap of the next retirement
R_KEY0: Final = 6  # the race's random key
R_KEY1: Final = 7
R_CLOCK_MS: Final = 8  # reference clock, ms
R_SC_LAPS: Final = 9  # laps run behind the safety car so far
R_VSC_LAPS: Final = 10
R_FLAGGED: Final = 11  # 1 after the chequered flag
R_NO_DRS: Final = 12  # laps for which DRS is still off, the coming one included
R_RESTART: Final = 13  # 1 where the coming lap begins from a standing grid after a red flag
R_SCRIPTED: Final = 14  # 1 where the race replays a script: classified as it happened, without the two-compound rule
R_RED_LAPS: Final = 15
R_WATCHED: Final = 16  # 1 where lap times are followed, for those who call cars from outside
R_SIZE: Final = 17

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
    T_STINT,  # spread of a stint's pace
    T_EVOLUTION,
    T_PASSED_LOSS,
    T_RED,  # share of safety cars that become a red flag
    T_IN_SHARE,
    T_STACK,
    T_PER_PLACE,  # restart from a standing grid, per place
) = range(36)
T_SIZE: Final = 36

# car figures, float32
C_PACE, C_FORM, C_NOISE, C_START, C_RETIRE, C_STOP, C_LAP1, C_TAIL = range(8)
C_ROWS: Final = 8

# tyre figures, float32
Y_OFFSET, Y_LINEAR, Y_QUADRATIC, Y_COLD = range(4)

# whole-number figures, int32
I_LAPS, I_CARS, I_MAX_LAPS_PER_SET = range(3)

# plan table, int32: stops, start compound, then (lap, compound) per stop, then the windows of the safety-car reaction
P_STOPS, P_START, P_FIRST = 0, 1, 2
MAX_STOPS: Final = 8
P_SC_WINDOW: Final = P_FIRST + 2 * MAX_STOPS
P_VSC_WINDOW: Final = P_SC_WINDOW + 1
P_COLUMNS: Final = P_VSC_WINDOW + 1
NO_STOP: Final = 1000  # K_NEXT of a car without further planned stops

MIN_STINT_LAPS: Final = 2  # a set that has done fewer laps is not changed for a safety car, and no plan puts two stops closer together
