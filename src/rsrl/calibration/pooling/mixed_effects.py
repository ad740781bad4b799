"""Partial pooling: a linear model of Gaussian effects in groups (tracks, seasons, races ...), each group's spread learned from the data.

An observation is a sum of effects plus an error whose covariance is known (the standard errors of the first stage):

y = sum of coefficient x effect + error,   effect of group g ~ N(mean, sd_g^2)

The sd of a group is the maximum of the marginal likelihood (REML, as a fixed effect is a group of one with a wide prior of its own),
penalised by log sd - sd / scale: with no data the sd is `scale`, and it never becomes zero (Chung et al. 2013, Psychometrika 78), so that
two seasons are not declared equal for want of evidence. Effects come out as their posterior means, with covariance.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

Array = npt.NDArray[np.float64]
Effect = tuple[str, str]
"""Group and label, such as ("track", "bahrain")."""

Terms = Mapping[Effect, float]
"""A linear combination of effects."""

SD_RANGE: Final = 1e4
"""An sd stays within this factor of its scale, either way."""


class Group(NamedTuple):
    """Prior of a group's effects: mean, and sd either known (`learned` False) or with `sd` as the scale of what is learned."""

    sd: float
    mean: float = 0.0
    learned: bool = True


@dataclass(frozen=True)
class Mixed:
    """A fitted model. `sds` by group; predictions of any combination of effects, seen or not."""

    groups: dict[str, Group]
    sds: dict[str, float]
    effects: dict[Effect, int]  # column of the design
    design: Array  # [observations, effects]
    prior_var: Array  # [effects]
    weights: Array  # S^-1 (y - mean)
    factor: Array  # L^-1, S = L L'

    def predict(self, terms: Terms) -> tuple[float, float]:
        """Value and standard error of a combination; an effect no observation had counts with its group's whole spread."""
        means, cov = self.predict_all([terms])
        return float(means[0]), float(np.sqrt(max(cov[0, 0], 0.0)))

    def predict_all(self, combinations: Sequence[Terms]) -> tuple[Array, Array]:
        """Values of several combinations and their joint covariance."""
        names = sorted({name for terms in combinations for name in terms})
        c = np.array([[terms.get(name, 0.0) for name in names] for terms in combinations])
        var = np.array([self.sds[g] ** 2 for g, _ in names])
        mean = c @ np.array([self.groups[g].mean for g, _ in names])
        seen = np.array([self.effects.get(name, -1) for name in names])
        known = seen >= 0
        cross = (c[:, known] * var[known]) @ self.design[:, seen[known]].T  # covariance of combination and observation
        half = cross @ self.factor.T
        return mean + cross @ self.weights, (c * var) @ c.T - half @ half.T


def fit_mixed(y: npt.ArrayLike, cov: npt.ArrayLike, rows: Sequence[Terms], groups: Mapping[str, Group]) -> Mixed:
    """Fit.

    Args:
        y: observations.
        cov: covariance of their errors, [n, n], or variances [n].
        rows: which effects make each observation, with coefficients.
        groups: prior of every group named in `rows`.
    """
    names = sorted({name for terms in rows for name in terms})
    effects = {name: i for i, name in enumerate(names)}
    design = np.zeros((len(rows), len(names)))
    for i, terms in enumerate(rows):
        for name, factor in terms.items():
            design[i, effects[name]] += factor
    error = np.asarray(cov, dtype=np.float64)
    error = np.diag(error) if error.ndim == 1 else error
    mean = design @ np.array([groups[g].mean for g, _ in names])
    left = np.asarray(y, dtype=np.float64) - mean
    sds = _spreads(left, error, design, names, groups)
    prior_var = np.array([sds[g] ** 2 for g, _ in names])
    total = error + (design * prior_var) @ design.T
    lower = np.linalg.cholesky(total)
    inverse = np.linalg.inv(lower)
    return Mixed(dict(groups), sds, effects, design, prior_var, inverse.T @ (inverse @ left), inverse)


def _spreads(left: Array, error: Array, design: Array, names: Sequence[Effect], groups: Mapping[str, Group]) -> dict[str, float]:
    """Each group's sd: the known ones, and the others where the penalised marginal likelihood is greatest."""
    own = {g: design[:, [i for i, (group, _) in enumerate(names) if group == g]] for g in groups}
    kernels = {g: z @ z.T for g, z in own.items() if z.shape[1]}
    learned = [g for g in kernels if groups[g].learned]
    fixed = error + sum((kernels[g] * groups[g].sd ** 2 for g in kernels if not groups[g].learned), np.zeros_like(error))
    scales = np.array([groups[g].sd for g in learned])

    def cost(logs: Array) -> tuple[float, Array]:
        sds = scales * np.exp(logs)
        total = fixed + sum((kernels[g] * s**2 for g, s in zip(learned, sds, strict=True)), np.zeros_like(error))
        root = cho_factor(total, lower=True)
        inverse = cho_solve(root, np.eye(len(left)))
        a = inverse @ left
        value = float(np.log(np.diag(root[0])).sum() + 0.5 * left @ a - np.sum(logs - np.exp(logs)))
        slopes = [s**2 * float(np.sum(inverse * kernels[g]) - a @ kernels[g] @ a) for g, s in zip(learned, sds, strict=True)]
        return value, np.array(slopes) - 1.0 + np.exp(logs)

    found = {g: groups[g].sd for g in groups}
    if learned:
        limit = np.log(SD_RANGE)
        best = minimize(cost, np.full(len(learned), -0.5), jac=True, method="L-BFGS-B", bounds=[(-limit, limit)] * len(learned))
        found |= {g: float(s) for g, s in zip(learned, scales * np.exp(best.x), strict=True)}
    return found


def block_diagonal(blocks: Iterable[Array]) -> Array:
    """One covariance of independent blocks."""
    parts = list(blocks)
    size = sum(len(b) for b in parts)
    whole, at = np.zeros((size, size)), 0
    for b in parts:
        whole[at : at + len(b), at : at + len(b)] = b
        at += len(b)
    return whole
