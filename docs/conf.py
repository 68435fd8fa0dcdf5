"""Documentation: `python -m sphinx -W --keep-going -b html docs docs/_build/html`, after `pip install .[docs]`."""

import sys
from importlib.metadata import version as installed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "ext"))

project = "guideload"
author = "the guideload authors"
project_copyright = author
release = installed("guideload")
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_click",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "docstrings",
    "keys",
]
exclude_patterns = ["_build"]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "none"  # docstrings give shapes and units, which types do not have
autodoc_member_order = "bysource"
smartquotes = False  # "--rate" keeps its two dashes
html_theme = "furo"
html_title = "guideload"
html_static_path = ["_static"]
html_css_files = ["tables.css"]
html_copy_source = False
