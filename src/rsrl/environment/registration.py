"""Registers the environment with Gymnasium; done once, on `import rsrl.environment`.

Gymnasium 1.x has no plug-ins: a package registers when it is imported, or by naming it, as in
`gymnasium.make("rsrl.environment:rsrl/Race-v0")`.
"""

from typing import Final

import gymnasium

ENV_ID: Final = "rsrl/Race-v0"


def register_environments() -> None:
    """Make `ENV_ID` known to `gymnasium.make` and `gymnasium.make_vec`."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(
            id=ENV_ID,
            entry_point="rsrl.environment.gymnasium_env:RaceEnv",
            vector_entry_point="rsrl.environment.gymnasium_vector_env:RaceVectorEnv",
        )
