"""Penalised robust linear regression with named columns: every pace figure is a coefficient of one of these fits.

A column carries a Gaussian prior (`sd` infinite: none). With residual sd s, weights w and prior precision P the estimate is
(X'WX / s^2 + P)^-1 (X'Wy / s^2 + P m). Weights are Huber's, so that a few odd laps do not move it. Standard errors are clustered:
residuals of one car in one race are correlated from lap to lap, and counting them as independent would make errors far too small.
"""

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

HUBER_K: Final = 1.8
"""Residuals beyond this many robust standard deviations are down-weighted."""


@dataclass
class Design:
    """Columns of a regression, collected by name."""

    rows: int
    names: list[str] = field(default_factory=list)
    columns: list[Array] = field(default_factory=list)
    means: list[float] = field(default_factory=list)
    sds: list[float] = field(default_factory=list)

    def add(self, name: str, values: npt.ArrayLike, mean: float = 0.0, sd: float = np.inf) -> None:
        """Add a column with prior N(mean, sd^2); one that is zero everywhere is kept only if it has a prior."""
        column = np.asarray(values, dtype=np.float64)
        if column.shape != (self.rows,):
            raise ValueError(f"column {name} has shape {column.shape}, the design {self.rows} rows")
        if not column.any() and not np.isfinite(sd):
            return
        self.names.append(name)
        self.columns.append(column)
        self.means.append(mean)
        self.sds.append(sd)


@dataclass(frozen=True)
class LinearFit:
    """A fitted regression: coefficients by name, their covariance, and what is left."""

    names: tuple[str, ...]
    beta: Array
    cov: Array  # clustered, unless replaced
    model_cov: Array  # of the model itself: rows independent, weights right
    sigma: float  # robust residual sd
    residuals: Array
    weights: Array

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def with_cov(self, cov: Array) -> "LinearFit":
        """The fit with another covariance of its coefficients."""
        return replace(self, cov=cov)

    def combine(self, terms: dict[str, float]) -> tuple[float, float]:
        """Value and standard error of a linear combination of coefficients; a name not in the fit counts as zero."""
        v = np.zeros(len(self.names))
        for name, factor in terms.items():
            if name in self.names:
                v[self.names.index(name)] += factor
        return float(v @ self.beta), float(np.sqrt(max(float(v @ self.cov @ v), 0.0)))

    def value(self, name: str) -> float:
        """One coefficient, zero where it is not in the fit."""
        return self.combine({name: 1.0})[0]


def fit(
    design: Design, y: npt.ArrayLike, clusters: npt.ArrayLike, row_weights: npt.ArrayLike | None = None, iterations: int = 12
) -> LinearFit:
    """Fit by iteratively re-weighted penalised least squares.

    Args:
        design: the columns.
        y: what is explained, one value per row.
        clusters: label per row; residuals are taken as independent between clusters only.
        row_weights: what a row counts for, besides Huber's weight; 1 by default.
        iterations: re-weightings, a fixed number so that the result is the same everywhere.
    """
    x = np.column_stack(design.columns)
    target = np.asarray(y, dtype=np.float64)
    precision = np.array([0.0 if np.isinf(s) else s**-2 for s in design.sds])
    prior = precision * np.array(design.means)
    base = np.ones(len(target)) if row_weights is None else np.asarray(row_weights, dtype=np.float64)
    weights = base
    sigma = float(np.std(target)) or 1.0
    beta = np.zeros(x.shape[1])
    for _ in range(iterations):
        weighted = (x * weights[:, None]).T
        beta = np.linalg.solve(_ridged(weighted @ x / sigma**2 + np.diag(precision)), weighted @ target / sigma**2 + prior)
        residuals = target - x @ beta
        sigma = max(robust_sd(residuals[base >= base.max()]), 1e-6)
        scaled = np.abs(residuals) / (HUBER_K * sigma)
        weights = base / np.maximum(scaled, 1.0)
    bread: Array = np.asarray(np.linalg.inv(_ridged((x * weights[:, None]).T @ x / sigma**2 + np.diag(precision))), dtype=np.float64)
    cov = _clustered(x, residuals, weights, sigma, precision, np.asarray(clusters), bread)
    return LinearFit(tuple(design.names), beta, cov, bread, sigma, residuals, weights)


def _ridged(matrix: Array) -> Array:
    """The matrix with a ridge too thin to matter, so that columns that say the same thing do not stop the fit."""
    return matrix + 1e-9 * float(np.mean(np.diag(matrix))) * np.eye(len(matrix))


def robust_sd(values: npt.ArrayLike) -> float:
    """Standard deviation of a normal sample, from the median absolute deviation."""
    v = np.asarray(values, dtype=np.float64)
    return float(1.4826 * np.median(np.abs(v - np.median(v))))


def _clustered(
    x: Array, residuals: Array, weights: Array, sigma: float, precision: Array, clusters: npt.NDArray[np.generic], bread: Array
) -> Array:
    """Sandwich covariance over clusters, the prior standing in as one more independent observation per column."""
    labels, index = np.unique(clusters, return_inverse=True)
    scores = np.zeros((len(labels), x.shape[1]))
    np.add.at(scores, index, x * (weights * residuals)[:, None] / sigma**2)
    correction = len(labels) / max(len(labels) - 1, 1)
    meat = correction * scores.T @ scores + np.diag(precision)
    return np.asarray(bread @ meat @ bread, dtype=np.float64)
