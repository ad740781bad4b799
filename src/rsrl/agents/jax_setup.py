"""JAX, configured before its first import to compute on a single thread.

XLA's threads would compete for cores with the simulator; one thread for the update and the others for simulation train faster. JAX uses a
GPU where there is one and `rsrl[gpu]` is installed. `XLA_FLAGS` and `JAX_PLATFORMS` set by the user take precedence.
"""

import os
from typing import Any

_SINGLE_THREAD = "--xla_cpu_multi_thread_eigen=false"
if "xla_cpu_multi_thread_eigen" not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {_SINGLE_THREAD}".strip()

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402

from rsrl import compile_watch  # noqa: E402

__all__ = ["jax", "jnp"]

_COMPILE_EVENT = "/jax/core/compile/backend_compile_duration"
"""JAX reports a number under this name when XLA begins, and a duration when it has ended or failed."""


def _on_begin(event: str, value: float, **about: Any) -> None:
    if event == _COMPILE_EVENT:
        compile_watch.update_compilation_begins()


def _on_end(event: str, duration_secs: float, **about: Any) -> None:
    if event == _COMPILE_EVENT:
        compile_watch.update_compilation_ends()


jax.monitoring.register_scalar_listener(_on_begin)
jax.monitoring.register_event_duration_secs_listener(_on_end)
