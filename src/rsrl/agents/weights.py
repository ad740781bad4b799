"""Conversion of nested weights and optimiser states to flat named arrays and back."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.jax_setup import jax
from rsrl.agents.networks import Params
from rsrl.errors import RsrlError


def to_numpy(params: Params) -> Params:
    """Copies as NumPy arrays; blocks until they are computed."""
    return {name: np.array(value) for name, value in params.items()}


def join_state(**parts: Any) -> dict[str, NDArray[Any]]:
    """Flatten nested structures to arrays named `part/path`."""
    flat: dict[str, NDArray[Any]] = {}
    for part, tree in parts.items():
        for path, leaf in jax.tree_util.tree_flatten_with_path(tree)[0]:
            flat[_name(part, path)] = np.array(leaf)
    return flat


def split_state(flat: dict[str, NDArray[Any]], like: dict[str, Any]) -> dict[str, Any]:
    """Undo `join_state`, given structures of the same shape.

    Raises:
        RsrlError: an array is missing, superfluous, or of another shape or type.
    """
    names: set[str] = set()
    parts: dict[str, Any] = {}
    for part, tree in like.items():
        leaves, shape = jax.tree_util.tree_flatten_with_path(tree)
        names.update(_name(part, path) for path, _ in leaves)
        parts[part] = jax.tree_util.tree_unflatten(shape, [_leaf(flat, _name(part, path), leaf) for path, leaf in leaves])
    if set(flat) != names:
        raise RsrlError(f"training state holds unknown arrays ({', '.join(sorted(set(flat) - names)[:3])}); start training anew")
    return parts


def _leaf(flat: dict[str, NDArray[Any]], name: str, like: Any) -> NDArray[Any]:
    if name not in flat:
        raise RsrlError(f"training state lacks {name}; start training anew")
    value = flat[name]
    if value.shape != np.shape(like) or value.dtype != np.asarray(like).dtype:
        raise RsrlError(f"training state's {name} is {value.dtype} {value.shape}, not as this learner needs it; start training anew")
    return value


def _name(part: str, path: Any) -> str:
    return "/".join([part, *(str(getattr(key, "key", getattr(key, "idx", getattr(key, "name", key)))) for key in path)])
