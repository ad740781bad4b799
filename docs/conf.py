"""Sphinx: `make docs` builds the site, warnings as errors."""

import pkgutil
from pathlib import Path

import rsrl

project = "RSRL"
author = "RSRL contributors"
copyright = "RSRL contributors"
version = release = rsrl.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"RSRL {version}"

myst_heading_anchors = 3

suppress_warnings = ["ref.python"]  # names such as feature_set are attributes of several classes
default_role = "code"  # single backticks in docstrings are code
autodoc_default_options = {"members": True, "member-order": "bysource", "show-inheritance": True}
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_use_ivar = True
napoleon_numpy_docstring = False
add_module_names = False
python_use_unqualified_type_names = True

NOT_IN_REFERENCE = ("cli", "compiled")


def write_reference(folder: Path) -> None:
    """A page for each package: what its `__all__` lists, from the docstrings."""
    folder.mkdir(exist_ok=True)
    names = [f"rsrl.{module.name}" for module in pkgutil.iter_modules(rsrl.__path__) if module.name not in NOT_IN_REFERENCE]
    for stale in set(folder.glob("*.md")) - {folder / f"{name}.md" for name in names}:
        stale.unlink()
    for name in names:
        page = folder / f"{name}.md"
        text = f"# {name}\n\n```{{eval-rst}}\n.. automodule:: {name}\n```\n"
        if not page.exists() or page.read_text(encoding="utf-8") != text:  # a page that stays as it was need not be built again
            page.write_text(text, encoding="utf-8")


write_reference(Path(__file__).parent / "reference" / "packages")
