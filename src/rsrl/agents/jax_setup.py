"""JAX, set up before its first import: one thread a computation; a GPU where there is one and `rsrl[gpu]` is installed, else the CPU.

XLA's own threads fight over the cores with the race simulator; one thread for the update and one for the
simulation train faster. A user's own `XLA_FLAGS` and `JAX_PLATFORMS` win.
"""

import os

_SINGLE_THREAD = "--xla_cpu_multi_thread_eigen=false"
if "xla_cpu_multi_thread_eigen" not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {_SINGLE_THREAD}".strip()

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402

__all__ = ["jax", "jnp"]
