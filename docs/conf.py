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
suppress_warnings = ["myst.header"]  # a page may begin below its parent's level

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the signature has them
napoleon_use_rtype = False

html_theme = "furo"
html_title = "DEM calibrator"
html_extra_path = ["site"]  # the way from the site's root to its front page
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"top_of_page_buttons": []}

linkcheck_timeout = 20


def setup(app: Sphinx) -> None:
    """Let blocks say that they are CSV, which Pygments does not colour and git hosts do."""
    app.add_lexer("csv", TextLexer)
