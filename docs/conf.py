"""Settings of the documentation site: `python3 build.py docs`."""

from __future__ import annotations

import sys
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx

from percussion_model.interface.explore.build import is_at_hand, page_file

sys.path.insert(0, str(Path(__file__).parent / "site"))

project = "percussion_model"
author = "percussion_model developers"
copyright = author

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "mathml",
    "notebooks",
]
source_suffix = {".md": "markdown"}
root_doc = "index"
exclude_patterns = ["site"]
# Names of fields and words for types in docstrings are no references.
suppress_warnings = ["ref.python"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
myst_dmath_double_inline = False

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = "Percussion model"
html_math_renderer = "mathml"
html_static_path = ["site"]
html_extra_path = []
if is_at_hand():  # making the engine for browsers takes minutes
    html_extra_path.append(str(page_file()))
    tags.add("page")  # type: ignore[name-defined]  # noqa: F821
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_search_scorer = str(Path(__file__).parent / "site" / "scorer.js")
pygments_style = "default"

# Files beside docs/ that pages link to, and the pages of the site that show them.
BESIDE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "developers/contributing.md",
    "CHANGELOG.md": "developers/changelog.md",
    "benchmarks/RECORD.md": "developers/record.md",
}


# Measurements, methods in full and pages for developers: linked, but in neither menu nor search.
ASIDE = ("data/", "accuracy/", "developers/", "modal", "numerics")


def set_aside(app: Sphinx, page: nodes.document) -> None:
    """Keep pages of measurements out of the search, and let no menu list them."""
    if app.env.docname.startswith(ASIDE):
        app.env.metadata[app.env.docname].update({"orphan": "", "nosearch": ""})


def link_figures(app: Sphinx, page: nodes.document, name: str) -> None:
    """Let a click on a figure open it in full: pages are narrower than some."""
    for image in list(page.findall(nodes.image)):
        within = isinstance(image.parent, nodes.reference) or image["uri"].startswith("data:")
        if not within:
            file = f"{'../' * name.count('/')}{app.builder.imagedir}/{Path(image['uri']).name}"
            link = nodes.reference("", "", refuri=file)
            image.replace_self(link)
            link += image


def link_pages(app: Sphinx, name: str, source: list[str]) -> None:
    """Let links to files beside docs/ lead to their pages."""
    up = "../" * name.count("/")
    for file, page in BESIDE.items():
        source[0] = source[0].replace(f"]({up}../{file}", f"]({up}{page}")


def setup(app: Sphinx) -> None:
    """Connect what Sphinx calls."""
    app.connect("source-read", link_pages)
    app.connect("doctree-read", set_aside)
    app.connect("doctree-resolved", link_figures)
