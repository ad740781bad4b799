"""Simulate the 2023 Bahrain Grand Prix, then search for Hamilton's best plan and race it against the published one.

python examples/simulate_and_plan.py
"""

import rsrl

RACE, DRIVER = "bahrain-2023", "HAM"
RACES = 2_000
SEARCH_RACES = 10_000


def main() -> None:
    """Simulate, search, compare on the same races."""
    # The same seed draws the same safety cars, rivals and noise, whatever anyone's plan: the difference is the plan's alone.
    found = rsrl.plan(RACE, driver=DRIVER, races=SEARCH_RACES).best
    for plan in (rsrl.load_race(RACE).published[0], found):
        positions = rsrl.simulate(RACE, driver=DRIVER, plan=plan, races=RACES, seed=1).positions(DRIVER)
        print(f"{plan!s:14} P{positions.mean():.2f} on average, podium in {(positions <= 3).mean():.0%} of {RACES:,} races")


if __name__ == "__main__":
    main()
