"""Train a small policy for one race and car, and let it call races that training has not seen.

    python examples/train_policy.py

It starts from the calls of least expected time (the strategist `dp`) and learns what to change. A few iterations show how it is
done; the shipped policies took 250 and 900 (docs/models.md).
"""

from rsrl.agents import Budget, LearnerConfig, RsrlConfig, train
from rsrl.evaluation import run_races
from rsrl.rollouts import BranchingRaces
from rsrl.season import find_car, load_race
from rsrl.strategists import PolicyStrategist

ITERATIONS = 5
RACES = 384


def main() -> None:
    """Train, then evaluate."""
    record = load_race("bahrain-2023")
    car = find_car(record, "HAM")

    def environment(config: LearnerConfig) -> BranchingRaces:
        return BranchingRaces([(record, car)], feature_set=config.feature_set)

    trained = train(environment, RsrlConfig(), Budget(iterations=ITERATIONS), seed=0)
    print(f"{trained.steps:,} rollouts in {ITERATIONS} iterations")

    log = run_races(PolicyStrategist(trained.agent, record, "small policy"), record, car, seed=7, races=RACES)
    print(f"{log.strategist}: P{log.position.mean():.2f} on average over {RACES} races, {log.invalid.sum()} outside the rules")


if __name__ == "__main__":
    main()
