"""The policy in the package: small, of this version's features and figures, and sane."""

import numpy as np

from rsrl.agents import load_agent
from rsrl.evaluation import run_races
from rsrl.season import RaceRecord, race_hash
from rsrl.state import input_names
from rsrl.strategists import PolicyStrategist, find_model, make_strategist


def test_shipped_policy_belongs_to_the_shipped_race(bahrain: RaceRecord) -> None:
    folder = find_model("bahrain-2023")
    agent, about = load_agent(folder)
    assert sum(path.stat().st_size for path in folder.iterdir()) < 300_000
    assert (about.race, about.driver, about.season_hash) == (bahrain.name, bahrain.default_driver, race_hash(bahrain))
    assert agent.feature_names == input_names(agent.feature_set)
    assert about.command.startswith("rsrl train bahrain-2023")


def test_shipped_policy_finishes_within_the_rules_and_ahead_of_the_published_plans(bahrain: RaceRecord) -> None:
    car = bahrain.car_index(bahrain.default_driver)
    agent, _ = load_agent(find_model("bahrain-2023"))
    policy = run_races(PolicyStrategist(agent, bahrain, "rsrl"), bahrain, car, 99, 1000)
    fixed = run_races(make_strategist("fixed", bahrain, car), bahrain, car, 99, 1000)
    assert not policy.invalid.any()
    assert set(np.unique(policy.stops[~policy.retired])) <= {1, 2, 3, 4}
    assert (fixed.position - policy.position).mean() > 0.3
