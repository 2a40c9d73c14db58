"""How the pages become a site (extra ``docs``): ``sphinx-build -W -b html docs BUILD``. A code host shows them, too."""

from __future__ import annotations

import runpy
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent

project = "tactbench"
copyright = "the tactbench developers"  # noqa: A001
extensions = ["myst_parser"]
root_doc = "index"
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
html_theme = "alabaster"
html_theme_options = {"description": "A benchmark of tactile sensors", "page_width": "1100px", "sidebar_width": "240px"}
html_static_path: list[str] = []
html_copy_source = False
# Headings can be linked to as a code host does it; a link to none of them is an error.
myst_heading_anchors = 4
pygments_style = "friendly"

CONTENTS = {
    "Start": ("tutorial", "python", "glossary", "choosing", "tables", "statistics"),
    "Devices and recordings": ("hardware", "rig-files", "links", "emulation", "mappings", "datasets", "format"),
    "Plugins": ("plugins", "hooks", "plugin-reference", "conformance", "stability"),
    "Reference": ("commands", "sensors", "estimators", "protocols", "events", "parameters"),
    "Decisions": ("decisions/*",),
}
"""Contents of the sidebar; other pages follow. On a code host ``index.md`` leads to the pages, by reader."""


def add_contents(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append the table of contents that a site needs to the index."""
    if docname == root_doc:
        listed = {root_doc, *(page for pages in CONTENTS.values() for page in pages)}
        others = sorted(page for page in app.env.found_docs - listed if "/" not in page)
        trees = [
            f"```{{toctree}}\n:hidden:\n:glob:\n:caption: {caption}\n\n" + "\n".join(pages) + "\n```"
            for caption, pages in {**CONTENTS, "More": others}.items()
        ]
        source[0] = "\n\n".join([source[0], *trees])


def write_references(_: Sphinx) -> None:
    """Write the generated pages, which git ignores, beside the others."""
    plugins, commands, parameters = (
        runpy.run_path(str(HERE / f"{name}_reference.py")) for name in ("plugin", "command", "parameter")
    )
    made = (
        ("plugin-reference", plugins["reference"]),
        ("rig-files", plugins["rig_files"]),
        ("commands", commands["reference"]),
        ("parameters", parameters["reference"]),
    )
    for page, write in made:
        (HERE / f"{page}.md").write_text(write(), encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Connect both."""
    app.connect("builder-inited", write_references)
    app.connect("source-read", add_contents)
