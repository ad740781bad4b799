"""Compare two strategists on the same races: the shipped policy `all` and the calls of least expected time that it learned from.

python examples/evaluate_paired.py
"""

import rsrl

RACES = 768


def main() -> None:
    """Let both call the same races and print the paired difference."""
    for row in rsrl.evaluate("bahrain-2023", "all", driver="HAM", strategists=["dp"], seed=7, races=RACES):
        low, high = row.difference_ci95
        print(f"{row.strategist:4} P{row.mean_position:.2f}, {row.difference:+.3f} [{low:+.3f}, {high:+.3f}] places behind `all`")


if __name__ == "__main__":
    main()
