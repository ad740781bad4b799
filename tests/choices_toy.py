"""Teams that choose their plans by a known cost of tyres: for tests of what is learned from choices."""

from itertools import combinations

import numpy as np

from rsrl.calibration.choices import SEQUENCES, CarChoice, LapFigures, RaceChoices
from rsrl.calibration.entry import RaceKey

LAPS, PIT_S, TEMPERATURE_S = 52, 22.0, 1.5
FRESH_S = {1: 0.55, 2: 0.3, 3: 0.0, 4: -0.35, 5: -0.75}
WEAR_S = {1: 0.03, 2: 0.04, 3: 0.06, 4: 0.1, 5: 0.17}
"""By C-number: fresh lap against C3, and wear a lap: softer is quicker and wears more."""

SEVERITY = {"bahrain": 1.5, "spain": 1.2, "hungary": 1.0, "monaco": 0.6, "italy": 0.8, "austria": 1.0}
NOMINATIONS = ((1, 2, 3), (2, 3, 4), (3, 4, 5))
SEASONS = (2023, 2024)
HIDDEN = 0.4
"""Share of its wear that a stint of 15 laps shows in its lap times: drivers make their sets last."""


def plan_costs(compounds: tuple[int, ...], nominated: tuple[int, int, int], severity: float) -> tuple[np.ndarray, np.ndarray]:
    """Stop laps [plans, stops] and cost [plans] of every plan of a sequence; `nominated` are hard, medium and soft."""
    laps = np.array(list(combinations(range(4, LAPS - 3), len(compounds) - 1)))
    if len(compounds) > 3:
        laps = laps[::5]
    lengths = np.diff(laps, axis=1, prepend=0, append=LAPS)
    cost = np.full(len(laps), PIT_S * (len(compounds) - 1))
    for stint, code in enumerate(compounds):
        c = nominated[2 - code]
        cost += FRESH_S[c] * lengths[:, stint] + severity * WEAR_S[c] * lengths[:, stint] ** 2 / 2
    return laps, cost


def toy_race(season: int, number: int, track: str, nominated: tuple[int, int, int], rng: np.random.Generator) -> RaceChoices:
    """A race of 18 cars that finished; each draws its plan with log probability -cost / temperature."""
    options = [(c, *plan_costs(c, nominated, SEVERITY[track])) for c in SEQUENCES if len(c) < 4]
    best = np.array([cost.min() for _, _, cost in options])
    share = np.exp(-(best - best.min()) / TEMPERATURE_S)
    cars = []
    for grid in range(1, 19):
        compounds, laps, cost = options[rng.choice(len(options), p=share / share.sum())]
        odds = np.exp(-(cost - cost.min()) / TEMPERATURE_S)
        stops = tuple(int(x) for x in laps[rng.choice(len(laps), p=odds / odds.sum())])
        cars.append(CarChoice(f"D{grid:02d}", f"T{grid // 2}", grid, compounds, stops, (True,) * len(stops), LAPS, True))
    hard, medium, soft = (f"C{c}" for c in nominated)
    key = RaceKey(season, number, track, LAPS, {"S": soft, "M": medium, "H": hard})
    return RaceChoices(key, tuple(cars), wet=False, red=False, pit_loss_s=PIT_S, max_laps_per_set=0)


def toy_seasons(seed: int = 0) -> list[RaceChoices]:
    """Two seasons of twelve races."""
    rng = np.random.default_rng(seed)
    plans = [(track, nominated) for track in SEVERITY for nominated in NOMINATIONS[:2]]
    return [toy_race(season, i + 1, track, n, rng) for season in SEASONS for i, (track, n) in enumerate(plans)]


def managed_laps(races: list[RaceChoices]) -> dict[tuple[int, int], LapFigures]:
    """Slopes of lap times that show `HIDDEN` of the wear, with levels as they are."""
    found = {}
    for race in races:
        numbers = [int(race.key.c_numbers[c][1]) for c in "SMH"]
        slope = np.array([HIDDEN * SEVERITY[race.key.grand_prix] * WEAR_S[c] for c in numbers])
        level = np.array([FRESH_S[c] - FRESH_S[numbers[1]] for c in numbers])
        found[race.key.season_round] = LapFigures(slope, np.full(3, 0.005), level, np.full(3, 0.1))
    return found
