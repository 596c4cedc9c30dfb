"""Settings of the documentation's site: `make site` builds it with Sphinx, and warnings are errors.

The repository's root is Sphinx's source folder, so that the links of a page lead to the same files here and on a code
host. docs/site has the extensions, among them the front page, and the style.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT), str(HERE), str(HERE / "site")]

from labgym import __version__  # noqa: E402 - of this checkout, which the line above puts first

project = "labgym"
author = project_copyright = "labgym contributors"
release = version = __version__

root_doc = "docs/index"
SOURCES = {"docs", "policies", "README.md", "CHANGELOG.md", "CONTRIBUTING.md"}
include_patterns = ["docs/**", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "policies/*/CARD.md"]
exclude_patterns = [*sorted({path.name for path in ROOT.iterdir()} - SOURCES), "docs/site"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "accessible",
    "commands",
    "contents",
    "docstrings",
    "front",
    "mathml",
    "repository",
    "schemas",
    "search",
]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
smartquotes = False  # pages quote values of options
highlight_language = "text"
default_role = "code"

autodoc_default_options = {"members": True, "undoc-members": True, "show-inheritance": True}
toc_object_entries = False  # furo copies the whole tree for every page: seconds a page with all members
napoleon_use_rtype = False  # the signature has the type
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
OPTIONAL = ("numba", "openai", "pxr", "pyarrow", "safetensors", "stable_baselines3", "torch", "warp", "yaml")
autodoc_mock_imports = [name for name in OPTIONAL if find_spec(name) is None]

html_theme = "furo"
pygments_dark_style = "github-dark"
html_title = f"labgym {release}"
html_static_path = ["site/static"]
html_css_files = ["style.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {  # the colors of labgym/eval/reports/templates/site.css
    "light_css_variables": {
        "color-brand-primary": "#00639c",
        "color-brand-content": "#00639c",
        "color-brand-visited": "#00639c",
        "color-background-primary": "#ffffff",
        "color-background-secondary": "#f6f5f1",
        "color-background-border": "#dedbd3",
        "color-foreground-primary": "#1d2329",
        "color-foreground-secondary": "#5b656e",
        "color-foreground-muted": "#5b656e",
    },
    "dark_css_variables": {
        "color-brand-primary": "#72bdec",
        "color-brand-content": "#72bdec",
        "color-brand-visited": "#72bdec",
        "color-background-primary": "#1c2126",
        "color-background-secondary": "#14171a",
        "color-background-border": "#333a41",
        "color-foreground-primary": "#e6e9eb",
        "color-foreground-secondary": "#9fa9b1",
        "color-foreground-muted": "#9fa9b1",
    },
}
