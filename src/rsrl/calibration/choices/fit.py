"""Fits of the choice model: to all races given, or race by race through a season, each fit starting from the last."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from rsrl.calibration.choices.arrays import LapFigures, choice_arrays, race_arrays, setting_before
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
        self.races = tuple(r for r in races if r.clean and r.key.c_numbers)
        if not self.races:
            raise RsrlError("no dry race whose choices of tyres are known in the lap files given; add a season with --seasons")
        self.space = space_of([(r.key.circuit, r.key.season) for r in self.races])
        self._choices = choice_arrays(self.races, lap_figures or {})
        self._objective: Any = None
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
            use = np.array([float(r.key.season_round < date) for r in self.races])
            if not use.any():
                raise RsrlError(
                    f"no dry race before {season} round {round_number} whose choices of tyres are known; give an earlier season"
                )
            earlier = any(r.key.season < season for r in self.races)
            opening = self.before(season, 0).deviates if round_number > 0 and earlier else np.zeros(self.space.size)
            steps = NEXT_STEPS if opening.any() else FIRST_STEPS
            self._found[date] = self._fit(use, opening, steps, tuple(r for r in self.history if r.key.season_round < date))
        return self._found[date]

    def _fit(self, use: Array, start: Array, steps: int, before: tuple[RaceChoices, ...]) -> ChoiceModel:
        import jax

        with jax.enable_x64(True):
            if self._objective is None:
                self._objective = _objective(self.space, self._arrays(), self._choices)
            found = minimize(
                lambda x: tuple(np.asarray(v, np.float64) for v in self._objective(x, use)),
                start,
                jac=True,
                method="L-BFGS-B",
                options={"maxiter": steps, "maxcor": 20, "ftol": TOLERANCE},
            )
        rows = {r.key.season_round: i for i, r in enumerate(self.races) if use[i] > 0}
        return ChoiceModel(self.space, found.x, rows, before)

    def _arrays(self) -> Any:
        """Settings of the races, each as it was known before it."""
        settings = [setting_before(r, [x for x in self.history if x.key.season_round < r.key.season_round]) for r in self.races]
        return race_arrays(settings, self.space, self.history)


def _objective(space: Space, arrays: Any, choices: Any) -> Any:
    """Value and slope of the negative log posterior, compiled once for a set of races."""
    import jax

    from rsrl.calibration.choices.likelihood import negative_log_posterior

    return jax.jit(jax.value_and_grad(lambda x, use: negative_log_posterior(x, space, arrays, choices, use)))
