"""Simulate the 2023 Bahrain Grand Prix, then search for Hamilton's best plan and race it against the published one.

python examples/simulate_and_plan.py
"""

from rsrl.season import find_car, load_race
from rsrl.simulator import Plan, simulate
from rsrl.strategists import search_plans

RACES = 2_000
SEARCH_RACES = 10_000


def main() -> None:
    """Simulate, search, compare on the same races."""
    record = load_race("bahrain-2023")
    car = find_car(record, "HAM")

    # The same seed draws the same safety cars, rivals and noise, whatever anyone's plan: the difference is the plan's alone.
    found = search_plans(record, car, budget=SEARCH_RACES).ranked[0]
    for plan in (Plan.parse(record.published[0]), found.plan):
        results = simulate(record, RACES, seed=1, plans={car: plan})
        positions = results.positions[:, car]
        print(f"{plan!s:14} P{positions.mean():.2f} on average, podium in {(positions <= 3).mean():.0%} of {RACES:,} races")


if __name__ == "__main__":
    main()
