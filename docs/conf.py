"""Sphinx: `make docs` builds the site, warnings as errors."""

from rsrl import __version__

project = "RSRL"
author = "RSRL contributors"
copyright = "RSRL contributors"
version = release = __version__

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
