"""Fits of the choice model: to all races given, or race by race through a season, each fit starting from the last."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from rsrl.calibration.choices.arrays import LapFigures, choice_arrays, padded_settings, race_arrays, rows_for, setting_before
from rsrl.calibration.choices.model import ChoiceModel
from rsrl.calibration.choices.observed import RaceChoices
from rsrl.calibration.choices.parameters import Space, space_of
from rsrl.errors import RsrlError

FIRST_STEPS: Final = 250
NEXT_STEPS: Final = 40
"""Steps of L-BFGS from the priors, and from a fit that lacked a race or two."""

TOLERANCE: Final = 1e-6

Array = NDArray[np.float64]


class ChoiceFits:
    """The choices of all races given, and the fit to those before any date; a fit does not depend on which others were made."""

    def __init__(self, races: Sequence[RaceChoices], lap_figures: Mapping[tuple[int, int], LapFigures] | None = None) -> None:
        """Take the races that can teach.

        Args:
            races: choices of races; wet ones, those with a red flag and those without C-numbers are left out.
            lap_figures: what lap times say of a race's tyres, by season and round.

        Raises:
            RsrlError: no race is left.
        """
        self.history = tuple(races)
        self.races = tuple(r for r in races if r.teaches)
        if not self.races:
            raise RsrlError("no dry race whose choices of tyres are known in the lap files given; add a season with --seasons")
        self.space = space_of([(r.key.circuit, r.key.season) for r in self.races], rows_for(len(self.races)))
        self._lap_figures = dict(lap_figures or {})
        self._found: dict[tuple[int, int], ChoiceModel] = {}

    def everything(self) -> ChoiceModel:
        """The fit to all races."""
        return self.before(self.races[-1].key.season + 1, 0)

    def before(self, season: int, round_number: int) -> ChoiceModel:
        """The fit to the races before a round of a season. Fits within a season start from the one before its first round.

        Raises:
            RsrlError: there is no race before it.
        """
        date = (season, round_number)
        if date not in self._found:
            races = [r for r in self.races if r.key.season_round < date]
            if not races:
                raise RsrlError(
                    f"no dry race before {season} round {round_number} whose choices of tyres are known; give an earlier season"
                )
            earlier = round_number > 0 and races[0].key.season < season
            opening = self.before(season, 0).deviates if earlier else np.zeros(self.space.size)
            self._found[date] = self._fit(races, opening, NEXT_STEPS if opening.any() else FIRST_STEPS)
        return self._found[date]

    def _fit(self, races: Sequence[RaceChoices], start: Array, steps: int) -> ChoiceModel:
        import jax

        history = tuple(r for r in self.history if r.key.season_round <= races[-1].key.season_round)
        settings = [setting_before(r, [x for x in history if x.key.season_round < r.key.season_round]) for r in races]
        with jax.enable_x64(True):
            arrays = race_arrays(padded_settings(settings), self.space, history), choice_arrays(races, self._lap_figures)
            objective = _objective(self.space)
            found = minimize(
                lambda x: tuple(np.asarray(v, np.float64) for v in objective(x, *arrays)),
                start,
                jac=True,
                method="L-BFGS-B",
                options={"maxiter": steps, "maxcor": 20, "ftol": TOLERANCE},
            )
        return ChoiceModel(self.space, found.x, {r.key.season_round: i for i, r in enumerate(races)}, history)


@functools.cache
def _objective(space: Space) -> Any:
    """Value and slope of the negative log posterior, compiled once for arrays of the same shapes."""
    import jax

    from rsrl.calibration.choices.likelihood import negative_log_posterior

    return jax.jit(jax.value_and_grad(lambda x, races, choices: negative_log_posterior(x, space, races, choices)))
