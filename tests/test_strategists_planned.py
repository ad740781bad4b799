"""Plans driven lap by lap: as the simulator drives them, legal, and the paper's fixed baseline."""

import dataclasses

import numpy as np
import pytest

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.evaluation import run_races
from rsrl.season import RaceRecord
from rsrl.simulator import Plan, check_plan, compile_figures, simulate_plans
from rsrl.strategists import FixedStrategist, PlannedStrategist
from rsrl.strategists.plan_search.planned import with_start


class OnePlan(PlannedStrategist):
    """Drives to one plan whatever tyre it starts on."""

    def __init__(self, plan: Plan) -> None:
        super().__init__("one plan")
        self.plan = plan

    def begin(self, environment: RaceEnvironment, seed: int, races: np.ndarray) -> None:
        self.assign([self.plan], np.zeros(len(races), np.int64))


@pytest.mark.parametrize(
    ("text", "sc_laps", "vsc_laps"),
    [("S-H@14-S@36", 0, 0), ("S-H@14-H@36", 9, 4), ("S-S@9-H@25-S@40", 30, 20), ("S-H@1-S@56", 12, 6), ("S-H@20", 0, 12)],
)
def test_plan_is_called_as_the_simulator_drives_it(bahrain: RaceRecord, text: str, sc_laps: int, vsc_laps: int) -> None:
    plan = dataclasses.replace(Plan.parse(text), sc_window_laps=sc_laps, vsc_window_laps=vsc_laps)
    car = bahrain.car_index("HAM")
    log = run_races(OnePlan(plan), bahrain, car, 11, 300)
    positions, _ = simulate_plans(compile_figures(bahrain), car, [plan], 11, log.races)
    same_start = log.start == plan.compounds[0]
    assert same_start.sum() > 200
    np.testing.assert_array_equal(log.position[same_start], positions[0][same_start])


def test_fixed_drives_a_published_plan_that_starts_on_the_tyre_drawn(bahrain: RaceRecord) -> None:
    record = dataclasses.replace(bahrain, published=("S-H@18-S@38", "S-H@17-H@37", "M-H@20-S@40"))
    log = run_races(FixedStrategist(record, 6, 0), record, 6, 5, 400)
    finished = [log.stints(int(i)) for i in np.flatnonzero(~log.retired)]
    soft = [laps for compounds, laps in finished if compounds[0] == 0]
    assert set(soft) == {(18, 38), (17, 37)}
    assert 0.4 < soft.count((18, 38)) / len(soft) < 0.6
    assert {laps for compounds, laps in finished if compounds[0] == 1} <= {(20, 40)}
    assert {laps for compounds, laps in finished if compounds[0] == 2} <= {(18, 38), (17, 37), (20, 40)}
    assert not log.invalid.any()


@pytest.mark.parametrize(
    ("published", "start", "driven"),
    [
        ("S-H@18-S@38", 1, "M-H@18-S@38"),
        ("S-H@18-S@38", 2, "H-H@18-S@38"),
        ("S-H@17-H@37", 2, "H-M@17-H@37"),  # H-H-H breaks the rules twice; a medium stands one step from hard, a soft two
        ("M-S@20", 0, "S-M@20"),
    ],
)
def test_stops_of_a_published_plan_with_another_tyre_first(bahrain: RaceRecord, published: str, start: int, driven: str) -> None:
    plan = with_start(Plan.parse(published), start, bahrain, 6)
    assert str(plan) == driven
    check_plan(plan, bahrain)


def test_a_record_without_published_strategies_is_refused(bahrain: RaceRecord) -> None:
    with pytest.raises(RsrlError, match="holds no published strategies"):
        FixedStrategist(dataclasses.replace(bahrain, published=()), 6, 0)
