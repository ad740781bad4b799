"""Registers the environment with Gymnasium on `import rsrl`, without importing either of them.

Gymnasium 1.0 removed its plug-in entry points: an environment is known once a package has registered it. `import rsrl` registers at once
where Gymnasium is loaded, and otherwise as soon as it is; so the order of the two imports does not matter, and
`gymnasium.make("rsrl:rsrl/Race-v0")`, which imports `rsrl` itself, always works.
"""

import sys

TYPE_CHECKING = False  # what type checkers take for True; to import it from `typing` takes longer than all else `import rsrl` does
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

ENV_ID = "rsrl/Race-v0"
GYMNASIUM = "gymnasium"


def register_environments() -> None:
    """Make `ENV_ID` known to `gymnasium.make` and `gymnasium.make_vec`; the environment is imported when one is made."""
    import gymnasium

    if ENV_ID not in gymnasium.registry:
        gymnasium.register(
            id=ENV_ID,
            entry_point="rsrl.environment.gymnasium_env:RaceEnv",
            vector_entry_point="rsrl.environment.gymnasium_vector_env:RaceVectorEnv",
        )


class _AfterGymnasium:
    """Finds Gymnasium as the other finders do, once, and registers when its module has run."""

    def find_spec(self, fullname: str, path: "Sequence[str] | None", target: "ModuleType | None" = None) -> "ModuleSpec | None":
        if fullname != GYMNASIUM:
            return None
        import importlib.util

        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(GYMNASIUM)
        if spec is None or spec.loader is None:
            return spec
        load = spec.loader.exec_module

        def load_and_register(module: "ModuleType") -> None:
            load(module)
            register_environments()

        spec.loader.exec_module = load_and_register  # type: ignore[method-assign]
        return spec


def register_with_gymnasium() -> None:
    """Register now where Gymnasium is loaded, otherwise when it is."""
    module = sys.modules.get(GYMNASIUM)
    if module is None:
        sys.meta_path.insert(0, _AfterGymnasium())
    elif hasattr(module, "register"):
        register_environments()
