"""A page in one file: styles, scripts and their digests for the Content-Security-Policy; tables by one macro."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from functools import lru_cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import tactbench
from tactbench.core.tables.text_table import WORDY, sort_value

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

_HERE = "tactbench.core.tables"


def render(
    package: str, template: str, *, title: str, styles: Sequence[str], scripts: Sequence[str], **values: Any
) -> str:
    """Return a page; everything in it is escaped.

    Parameters
    ----------
    package
        Whose folder ``template`` has the template, styles and scripts.
    styles, scripts
        Names of files; those that all pages share, ``page.css`` and ``sort.js``, come before them, ``print.css`` after.
    values
        What else the template shows; it extends ``base.html`` and can import the macros of ``table.html``.
    """
    from markupsafe import Markup

    style = _texts(_HERE, ["page.css"]) + _texts(package, styles) + _texts(_HERE, ["print.css"])
    script = '\n"use strict";\n(() => {\n' + _texts(_HERE, ["sort.js"]) + _texts(package, scripts) + "})();\n"
    return (
        _environment(package)
        .get_template(template)
        .render(
            title=title,
            version=tactbench.__version__,
            style=Markup(style),
            script=Markup(script),
            style_hash=_digest(style),
            script_hash=_digest(script),
            **values,
        )
    )


@lru_cache(maxsize=4)
def _environment(package: str) -> Environment:
    """Return what renders the templates of a package; each is compiled once."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    loader = ChoiceLoader([PackageLoader(one, "template") for one in (package, _HERE)])
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    environment.globals["wordy"] = WORDY
    environment.filters["prose"] = prose
    environment.filters["sort_value"] = sort_value
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode()
    return environment


def _texts(package: str, names: Sequence[str]) -> str:
    folder = resources.files(package) / "template"
    return "".join((folder / name).read_text(encoding="utf-8") for name in names)


def _digest(text: str) -> str:
    """Return what a Content-Security-Policy calls the text by."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def prose(text: Any) -> Markup:
    """Return text with what stands between backticks as code; everything in it is escaped."""
    from markupsafe import Markup, escape

    parts = str(text).split("`")
    if len(parts) % 2 == 0:  # a backtick without its partner is a backtick
        return escape(str(text))
    shown = [Markup("<code>{}</code>").format(part) if place % 2 else escape(part) for place, part in enumerate(parts)]
    return Markup("").join(shown)
