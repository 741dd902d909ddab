"""How Sphinx makes the site: `make docs`.

The source folder is the root of the repository, so that links between README, DESIGN and these
pages are the same on the site and on a git host.
"""

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

from calibrator import __version__

project = "DEM calibrator"
release = __version__
copyright = "its authors, GPL-3.0-or-later"

root_doc = "docs/index"
include_patterns = ["docs/**", "DESIGN.md", "CONTRIBUTING.md", "CHANGELOG.md", "grid/README.md"]
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",  # formulas without another server
]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4  # as git hosts make them

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
napoleon_use_ivar = True
napoleon_use_param = False
napoleon_use_rtype = False
default_role = "literal"  # docstrings put names into single backquotes
suppress_warnings = ["ref.python"]  # a word of a docstring that is also a name of several classes

html_theme = "furo"
html_title = "DEM calibrator"
html_extra_path = ["site"]  # the way from the site's root to its front page
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"top_of_page_buttons": []}

linkcheck_timeout = 20


def bars_as_they_stand(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Let |x| in a docstring be an absolute value, and no substitution."""
    lines[:] = [line.replace("|", r"\|") for line in lines]


def setup(app: Sphinx) -> None:
    """Docstrings are prose, and blocks may be CSV, which Pygments does not colour."""
    app.connect("autodoc-process-docstring", bars_as_they_stand)
    app.add_lexer("csv", TextLexer)
