"""The fitted choice model: tyres and plans of any race, seen or not, and how probable each sequence is."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from rsrl.calibration.choices.arrays import Setting, race_arrays
from rsrl.calibration.choices.observed import RaceChoices
from rsrl.calibration.choices.parameters import RACE_EFFECTS, RACE_SD, SEASON_EFFECTS, SEASON_SD, Space, grid_group

DRAWS: Final = 64
Array = NDArray[np.float64]


class RaceTyres(NamedTuple):
    """Tyres of a race in the light of choices, by compound, [3]: means and sds over what one weekend's tyres may do.

    Attributes:
        offset_s: fresh against the fresh medium.
        log_wear: log of the wear, s a lap.
    """

    offset_s: Array
    offset_sd: Array
    log_wear: Array
    log_wear_sd: Array


class RacePlans(NamedTuple):
    """Plans of a race.

    Attributes:
        log_choice: of every sequence under each draw of the weekend's tyres, [draws, groups, sequences].
        utility_s: seconds with preferences for starting tyres, at the mean of the draws, [groups, sequences].
        value_s: seconds alone, [sequences].
        costs_s: by lap of the first stop, [sequences, steps].
        allowed: log-odds by rule, [sequences].
        log_frequency: the baseline, [sequences].
        laps: of the race.
    """

    log_choice: Array
    utility_s: Array
    value_s: Array
    costs_s: Array
    allowed: Array
    log_frequency: Array
    laps: int

    def log_probability(self) -> Array:
        """Log probability of every sequence, [groups, sequences]."""
        return np.asarray(np.log(np.exp(self.log_choice).mean(axis=0)))

    def log_probability_given(self, others: Sequence[tuple[int, int]]) -> Array:
        """The same once other cars have chosen: draws weighted by how probable they made those choices.

        Args:
            others: (grid place, sequence) of each of them.
        """
        weight = np.zeros(len(self.log_choice))
        for grid, sequence in others:
            weight += self.log_choice[:, grid_group(grid), sequence]
        weight = np.exp(weight - weight.max())
        return np.asarray(np.log(np.einsum("d,dgs->gs", weight / weight.sum(), np.exp(self.log_choice))))

    def best_first_stop(self, sequence: int) -> float:
        """Lap of the first stop at which a sequence costs least, between the steps of the grid by a parabola."""
        costs = self.costs_s[sequence]
        steps = len(costs) + 1
        at = int(costs.argmin())
        between = 0.0
        if 0 < at < len(costs) - 1:
            bend = costs[at - 1] - 2 * costs[at] + costs[at + 1]
            between = 0.5 * (costs[at - 1] - costs[at + 1]) / bend if bend > 1e-9 else 0.0
        return (at + 1 + between) * self.laps / steps


@dataclass(frozen=True)
class ChoiceModel:
    """The model at one date.

    Attributes:
        deviates: the fitted parameters, see `parameters.Space`.
        rows: races fitted, by season and round.
        history: every race before the date.
    """

    space: Space
    deviates: Array
    rows: Mapping[tuple[int, int], int]
    history: tuple[RaceChoices, ...]

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Parameters by name."""
        return self.space.values(self.deviates)

    def tyres(self, setting: Setting) -> RaceTyres:
        """Tyres of a race; one that was fitted keeps its own effects."""
        import jax

        from rsrl.calibration.choices.likelihood import tyres_of

        with jax.enable_x64(True):
            a = race_arrays([setting], self.space, ())
            seen = [tyres_of(self.parameters, a, race, season) for race, season in self._draws(setting)]
        offset, log_wear = (np.array([np.asarray(t[i])[0] for t in seen]) for i in range(2))
        return RaceTyres(offset.mean(axis=0), offset.std(axis=0), log_wear.mean(axis=0), log_wear.std(axis=0))

    def plans(self, setting: Setting) -> RacePlans:
        """Plans of a race."""
        import jax

        with jax.enable_x64(True):
            a = race_arrays([setting], self.space, self.history)
            draws = [np.array(part) for part in zip(*self._draws(setting), strict=True)]
            chosen, utility, value, costs = (np.asarray(v) for v in _compiled()(self.parameters, a, *draws))
        return RacePlans(
            chosen[:, 0],
            utility.mean(axis=0)[0],
            value.mean(axis=0)[0],
            costs.mean(axis=0)[0],
            a.allowed[0],
            a.log_frequency[0],
            setting.laps,
        )

    def _draws(self, setting: Setting) -> list[tuple[Array, Array]]:
        """Race effects [1, 4] and season effects [1, 2] of each draw: fitted where the race or its season was, else from their priors."""
        normal = _normal_draws()
        p = self.parameters
        season = self.space.season(setting.season)
        fitted = any(s == setting.season for s, _ in self.rows)
        row = self.rows.get((setting.season, setting.round))
        found = []
        for z in normal:
            race = p["race"][row] if row is not None else z[: len(RACE_EFFECTS)] * np.array(RACE_SD)
            own = np.array([p["season_wear"][season], p["season_gap"][season]]) if fitted else SEASON_SD * z[len(RACE_EFFECTS) :]
            found.append((race[None], own[None]))
        return found[:1] if row is not None and fitted else found


def _normal_draws() -> Array:
    """Standard normal, spread evenly (Sobol), [DRAWS, effects]."""
    size = len(RACE_EFFECTS) + len(SEASON_EFFECTS)
    return np.asarray(qmc.MultivariateNormalQMC(np.zeros(size), seed=0).random(DRAWS))


@functools.cache
def _compiled() -> Any:
    """Choices, utilities, values and costs of races under many draws of their tyres, compiled once."""
    import jax

    from rsrl.calibration.choices.likelihood import log_choice, plans_of, tyres_of, utilities

    def one(p: dict[str, Any], a: Any, race: Any, season: Any) -> Any:
        plans = plans_of(p, a, tyres_of(p, a, race, season))
        return log_choice(p, a, plans), utilities(p, a, plans), plans.value, plans.costs

    return jax.jit(jax.vmap(one, in_axes=(None, None, 0, 0)))
