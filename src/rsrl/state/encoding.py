"""From raw feature rows to network input: categories one-hot, booleans 0 or 1, numbers scaled (gaps of any race by logarithm) and clipped.

As in the paper, a number's working range comes from many simulated races and stands in the season file, unless `Feature.fixed` gives it.
"""

import hashlib
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rsrl.compiled import kernel
from rsrl.errors import RsrlError
from rsrl.state.features import COLUMN, FEATURES, NO_CAR_GAP_S, WIDE, Feature, feature_set, input_names

Scaling = Mapping[str, tuple[float, float]]
"""Feature name to working range in natural units."""


LOGARITHMIC = -1
"""Stands in an encoder's rows for the width of a number that is scaled by its logarithm."""


class Encoder:
    """Turns raw rows into the input of a policy that reads one feature set.

    Attributes:
        rows, values: what the compiled encoder reads: column and width int32 [n, 2]; low end, factor and floor float32 [n, 3].

    Raises:
        RsrlError: the scaling lacks a feature of the set (the season file was never scaled).
    """

    def __init__(self, name: str, scaling: Scaling) -> None:
        self.feature_set = name
        self.features: tuple[Feature, ...] = feature_set(name)
        self.names = input_names(name)
        rows, values = [], []
        for feature in self.features:
            low, high = working_range(feature, scaling)
            kind = feature.width if feature.kind == "category" else LOGARITHMIC if feature.logarithmic else 0
            if feature.logarithmic:
                low, high = np.log1p(low), np.log1p(high)
            rows.append((COLUMN[feature.name], kind))
            values.append((low, (1.0 - feature.low) / (high - low), feature.low))
        self.rows = np.array(rows, np.int32)
        self.values = np.array(values, np.float32)

    @property
    def width(self) -> int:
        """Columns of the network input."""
        return len(self.names)

    def __call__(self, raw: NDArray[np.float32], out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """Encode raw rows float32 [n, RAW_SIZE] into float32 [n, width]."""
        result = np.empty((len(raw), self.width), np.float32) if out is None else out
        _encode(raw, self.rows, self.values, result)
        return result

    def schema_hash(self) -> str:
        """Names and order of the input columns, as 16 hex digits."""
        return hashlib.sha256("\n".join((self.feature_set, *self.names)).encode()).hexdigest()[:16]


def working_range(feature: Feature, scaling: Scaling) -> tuple[float, float]:
    """Natural range a feature is scaled from."""
    if feature.kind == "category":
        return 0.0, 1.0
    if feature.fixed is not None:
        return feature.fixed
    if feature.name not in scaling:
        raise RsrlError(f"the season file has no scaling for {feature.name}; make it again with `rsrl calibrate`")
    low, high = scaling[feature.name]
    if not high > low:
        raise RsrlError(f"the season file's scaling of {feature.name} runs from {low:g} to {high:g}; it must rise")
    return low, high


def fit_scaling(raw: NDArray[np.float32]) -> dict[str, tuple[float, float]]:
    """Working ranges of the features without a natural one: 1 % to 95 % quantile of raw rows [n, RAW_SIZE].

    Rows without the car in question are left out; where it is there in none, as two places away in a race of two cars, the range is that
    of any race (`WIDE`). The upper end is cut lower, because gaps have long tails and their first few seconds matter most.
    """
    ranges = {}
    for i, feature in enumerate(FEATURES):
        if feature.kind == "continuous" and feature.fixed is None:
            values = raw[:, i]
            there = values[values < NO_CAR_GAP_S]
            low, high = (float(q) for q in np.quantile(there, (0.01, 0.95))) if len(there) else WIDE[feature.name]
            ranges[feature.name] = (round(low, 3), round(max(high, low + 1e-3), 3))
    return ranges


@kernel(inline=True)
def encode_row(raw, rows, values, out):
    """One raw row [RAW_SIZE] to network input [width]; `rows` and `values` are an `Encoder`'s."""
    one, zero = np.float32(1.0), np.float32(0.0)
    column = 0
    for j in range(rows.shape[0]):
        value = raw[rows[j, 0]]
        width = rows[j, 1]
        if width > 0:
            code = np.int32(value)
            for c in range(width):
                out[column + c] = one if c == code else zero
            column += width
        else:
            if width == LOGARITHMIC:
                value = np.float32(np.log1p(np.float64(max(value, zero))))  # in double: the same bits on any machine
            floor = values[j, 2]
            scaled = floor + (value - values[j, 0]) * values[j, 1]
            out[column] = min(max(scaled, floor), one)
            column += 1


@kernel()
def _encode(raw, rows, values, out):
    for i in range(raw.shape[0]):
        encode_row(raw[i], rows, values, out[i])
