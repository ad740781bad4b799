"""Explain one call of the shipped policy: what each option would lead to, and what would have to change for another call.

python examples/explain_call.py
"""

from rsrl.explanation import explain_attribution, explain_counterfactual, explain_what_if, load_explained, reach
from rsrl.explanation.tree import find_tree
from rsrl.season import find_car, load_race

LAP = 10
FUTURES = 500


def main() -> None:
    """Simulate a race up to the lap, then ask."""
    record = load_race("bahrain-2023")
    car = find_car(record, "HAM")
    policy = load_explained("all")
    moment = reach(policy.strategist(record), record, car, LAP, seed=3)

    print(explain_what_if(policy, moment, races=FUTURES, seed=0).summary(), "\n")
    print(explain_attribution(policy, moment).summary(), "\n")
    print(explain_counterfactual(policy, moment, find_tree(policy, record, car)).summary())


if __name__ == "__main__":
    main()
