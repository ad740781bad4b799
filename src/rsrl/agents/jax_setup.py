"""JAX, configured before its first import to compute on a single thread.

XLA's threads would compete for cores with the simulator; one thread for the update and the others for simulation train faster. JAX uses a
GPU where there is one and `rsrl[gpu]` is installed. `XLA_FLAGS` and `JAX_PLATFORMS` set by the user take precedence.
"""

import os

_SINGLE_THREAD = "--xla_cpu_multi_thread_eigen=false"
if "xla_cpu_multi_thread_eigen" not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {_SINGLE_THREAD}".strip()

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402

__all__ = ["jax", "jnp"]
