"""Compare two strategists on the same races: the shipped policy `all` and the calls of least expected time that it learned from.

python examples/evaluate_paired.py
"""

from rsrl.agents import load_agent
from rsrl.evaluation import leaderboard, run_races
from rsrl.season import find_car, load_race
from rsrl.strategists import PolicyStrategist, find_model, make_strategist

RACES = 768


def main() -> None:
    """Let both call the same races and print the paired difference."""
    record = load_race("bahrain-2023")
    car = find_car(record, "HAM")
    agent, _ = load_agent(find_model("all"))
    policy = run_races(PolicyStrategist(agent, record, "all"), record, car, seed=7, races=RACES)
    other = run_races(make_strategist("dp", record, car), record, car, seed=7, races=RACES)

    for row in leaderboard(policy, [other]):
        low, high = row.difference_ci95
        print(f"{row.strategist:4} P{row.mean_position:.2f}, {row.difference:+.3f} [{low:+.3f}, {high:+.3f}] places behind `all`")


if __name__ == "__main__":
    main()
