"""The settings of the robustness study, on a small race."""

from dataclasses import replace

import numpy as np
import pytest
from reactive_race import reactive
from synthetic_race import figure, synthetic_race

from rsrl.agents import NetworkAgent
from rsrl.agents.networks import NETWORKS
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.evaluation import RobustnessPlan, robustness, run_in, self_play
from rsrl.season import RaceRecord
from rsrl.state import input_names
from rsrl.statistics import mean_interval
from rsrl.strategists import HeuristicStrategist, PolicyStrategist, Strategist, make_strategist

CAR = 5


def agent() -> NetworkAgent:
    names = input_names("full")
    network = NETWORKS["lstm"](len(names), 8)
    return NetworkAgent("rsrl", "full", names, True, network, network.init(np.random.default_rng(3)))


def uncertain(record: RaceRecord) -> RaceRecord:
    """The record with a pit loss and wear known badly."""
    pit = replace(record.pit, loss_green_s=figure(20.0)._replace(se=4.0))
    tyres = {c: replace(t, wear_s_per_lap=t.wear_s_per_lap._replace(se=0.04)) for c, t in record.tyres.items()}
    return replace(record, pit=pit, tyres=tyres)


@pytest.fixture(scope="module")
def record() -> RaceRecord:
    return uncertain(reactive(synthetic_race(), spread=0.1))


def makers(record: RaceRecord) -> list[Strategist]:
    return [PolicyStrategist(agent(), record, "model"), HeuristicStrategist(record, CAR, 0)]


def test_rows_are_what_the_races_say(record: RaceRecord) -> None:
    plan = RobustnessPlan(scales=(0.0, 2.0), draws=3, races=30)
    rows = {(row.rivals, row.scale): row for row in robustness(agent(), makers, record, CAR, 7, plan)}
    assert set(rows) == {(rivals, scale) for rivals in ("reactive", "plans", "itself") for scale in (0.0, 2.0)}
    model, heuristic = makers(record)
    for rivals in ("reactive", "plans"):
        environment = RaceEnvironment(record, CAR, batch=10, rivals=rivals)
        own, other = (run_in(environment, s, 7, 30).position for s in (model, heuristic))
        row = rows[rivals, 0.0]
        (against,) = row.against
        assert (row.mean_position, row.ci95, row.races, row.draws) == (own.mean(), mean_interval(own), 30, 1)
        assert against.strategist == "heuristic"
        assert against.difference == pytest.approx((other - own).mean())
        assert against.difference_ci95 == mean_interval(other - own)
        assert against.p_better == pytest.approx(np.mean(other > own) + np.mean(other == own) / 2)
    field = self_play(agent(), [model], record, CAR, 7, 30)[0]
    assert rows["itself", 0.0].mean_position == field.position.mean()
    assert rows["reactive", 2.0].draws == 3
    assert rows["reactive", 2.0].mean_position != rows["reactive", 0.0].mean_position


def test_nothing_is_left_to_chance_but_the_seed(record: RaceRecord) -> None:
    plan = RobustnessPlan(rivals=("plans",), scales=(1.0,), draws=2, races=20)
    told: list[tuple[int, int]] = []
    first = robustness(agent(), makers, record, CAR, 7, plan, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 2), (2, 2)]
    assert first == robustness(agent(), makers, record, CAR, 7, plan)
    assert first != robustness(agent(), makers, record, CAR, 8, plan)


def test_informed_pit_walls_are_made_for_each_draw(record: RaceRecord) -> None:
    asked: list[float] = []

    def make(believed: RaceRecord) -> list[Strategist]:
        asked.append(believed.pit.loss_green_s.value)
        return [make_strategist("heuristic", believed, CAR)]

    plan = RobustnessPlan(rivals=("plans",), scales=(2.0,), draws=3, races=12)
    robustness(agent(), make, record, CAR, 7, plan)
    assert asked == [20.0]
    asked.clear()
    robustness(agent(), make, record, CAR, 7, RobustnessPlan(rivals=("plans",), scales=(2.0,), draws=3, races=12, informed=True))
    assert len(set(asked)) == 3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"draws": 1}, "take 2 draws"),
        ({"races": 9}, "take 2 draws"),
        ({"rivals": ("aliens",)}, "unknown rivals 'aliens'"),
        ({"scales": ()}, "nothing to run"),
    ],
)
def test_a_plan_that_cannot_be_run_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        RobustnessPlan(**changes)  # type: ignore[arg-type]
