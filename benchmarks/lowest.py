"""The lowest versions that pyproject.toml allows, as pins for pip: `python benchmarks/lowest.py`; used by `make test-lowest`.

The packages RSRL runs on and those its tests need. Where a package's own requirements ask for a later version, pip says so.
"""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
TEST_TOOLS = ("hypothesis", "pytest", "pytest-xdist", "ray", "shap")
BOUND = re.compile(r"(?P<name>[\w.-]+)>=(?P<version>[\w.]+)")


def lower_bounds() -> dict[str, str]:
    """Lowest version of each dependency, and of the test tools among the development dependencies."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = [bound for line in (*project["dependencies"], *project["optional-dependencies"]["dev"]) if (bound := BOUND.fullmatch(line))]
    bounds = {bound["name"]: bound["version"] for bound in found}
    needed = [re.split(r"[^\w.-]", line)[0] for line in project["dependencies"]]
    return {name: bounds[name] for name in (*needed, *TEST_TOOLS)}


def main() -> int:
    """Print them as requirements."""
    for name, version in lower_bounds().items():
        print(f"{name}=={version}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
