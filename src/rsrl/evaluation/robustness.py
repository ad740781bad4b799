"""How a policy's lead holds against other rivals, and in seasons whose figures differ from the fitted ones.

Every setting is a way the rivals are called and a scale of the errors in the figures. The figures are drawn anew several times
(`season.perturbed`); a draw has races of its own, and the same draw is used at every scale and with all rivals.
"""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import Agent
from rsrl.environment import FieldEnvironment
from rsrl.errors import RsrlError
from rsrl.evaluation.leaderboard import share_behind
from rsrl.evaluation.paired import BATCH, Progress, run_in
from rsrl.evaluation.self_play import PolicyField
from rsrl.results import Against, RobustnessRow, Settings
from rsrl.season import RaceRecord, perturbed
from rsrl.simulator import Rivals
from rsrl.statistics import Interval, mean_interval
from rsrl.strategists import Strategist

RIVALS: Final = ("reactive", "plans", "itself")
"""Rivals called as teams call, by plans alone, or by the policy itself."""

MakeStrategists = Callable[[RaceRecord], Sequence[Strategist]]
"""Makes the model and the strategists it is compared with, from the figures that the pit wall believes."""


class RobustnessPlan(Settings, frozen=True, kw_only=True, omit_defaults=False):
    """What is to be run; result files hold it whole.

    Raises:
        RsrlError: too few draws or races, or unknown rivals.
    """

    rivals: tuple[str, ...] = RIVALS
    scales: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0)
    draws: int = 8
    races: int = 960
    first_race: int = 0
    informed: bool = False

    def __post_init__(self) -> None:
        if self.draws < 2 or self.races < 2 * self.draws:
            raise RsrlError(f"{self.races} races over {self.draws} draws; take 2 draws or more, of 2 races or more each")
        if unknown := [name for name in self.rivals if name not in RIVALS]:
            raise RsrlError(f"unknown rivals {unknown[0]!r}; there are {', '.join(RIVALS)}")
        if not self.scales or not self.rivals:
            raise RsrlError("nothing to run; give one scale and one way of rivals at least")

    @property
    def races_a_draw(self) -> int:
        """Races of one draw."""
        return -(-self.races // self.draws)


def robustness(
    agent: Agent, make: MakeStrategists, record: RaceRecord, car: int, seed: int, plan: RobustnessPlan, *, progress: Progress | None = None
) -> list[RobustnessRow]:
    """Run all settings of a plan, rivals by rivals, scale by scale.

    Args:
        agent: calls the rivals where they are `itself`.
        make: called once with `record`, or for every draw where pit walls are informed.
        seed: of the races, and of the draws of the figures.

    Raises:
        RsrlError: a wet race, or reactive rivals where the record has no figures for them.
    """
    common = None if plan.informed else make(record)
    rows, settings = [], list(product(plan.rivals, plan.scales))
    for i, (rivals, scale) in enumerate(settings):
        columns: dict[str, list[NDArray[np.int64]]] = {}
        for draw in range(plan.draws):
            true = perturbed(record, np.random.default_rng((seed, draw)), scale)
            believed = true if plan.informed else record
            for strategist in common or make(true):
                position = _positions(strategist, agent, true, believed, car, seed, rivals, plan, draw)
                columns.setdefault(strategist.name, []).append(position)
            if progress:
                progress(i * plan.draws + draw + 1, len(settings) * plan.draws)
        rows.append(_row(rivals, scale, {name: np.array(values) for name, values in columns.items()}))
    return rows


def _positions(
    strategist: Strategist,
    agent: Agent,
    true: RaceRecord,
    believed: RaceRecord,
    car: int,
    seed: int,
    rivals: str,
    plan: RobustnessPlan,
    draw: int,
) -> NDArray[np.int64]:
    """Finishing positions int64 [races a draw] of a strategist in one draw's races."""
    environment = FieldEnvironment(
        true,
        car,
        batch=min(BATCH, plan.races_a_draw),
        rivals=_simulated(rivals),
        caller=PolicyField(agent, believed) if rivals == "itself" else None,
        believed=None if believed == true else believed,
    )
    return run_in(environment, strategist, seed, plan.races_a_draw, first_race=plan.first_race + draw * plan.races_a_draw).position


def _simulated(rivals: str) -> Rivals | None:
    """The simulator's own kind of rivals; the record's where a policy calls them all."""
    return {"reactive": "reactive", "plans": "plans"}.get(rivals)  # type: ignore[return-value]


def _row(rivals: str, scale: float, positions: dict[str, NDArray[np.int64]]) -> RobustnessRow:
    """Summary of positions int64 [draws, races] by strategist, the model first."""
    (_, own), *others = positions.items()
    against = [
        Against(
            name,
            float(values.mean()),
            float((values - own).mean()),
            _interval(values - own, scale),
            share_behind(values, own),
        )
        for name, values in others
    ]
    return RobustnessRow(rivals, scale, 1 if scale == 0 else len(own), own.size, float(own.mean()), _interval(own, scale), tuple(against))


def _interval(values: NDArray[np.int64], scale: float) -> Interval:
    """Interval of the mean of values [draws, races]: races of a draw share its figures, so draws are the independent units."""
    return mean_interval(values.ravel() if scale == 0 else values.mean(axis=1))
