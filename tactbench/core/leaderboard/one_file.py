"""What a page in one file is made of: its own texts, their digests for the Content-Security-Policy, and prose."""

from __future__ import annotations

import base64
import hashlib
from importlib import resources
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from markupsafe import Markup

HOUSE = "tactbench.core.leaderboard"
"""Where the style lies that all pages share."""


def own(package: str, *names: str) -> str:
    """Return the texts `names` from the folder ``template`` of a package of ours, one after the other."""
    folder = resources.files(package) / "template"
    return "".join((folder / name).read_text(encoding="utf-8") for name in names)


def house_style() -> str:
    """Return the style that every page of ours begins with."""
    return own(HOUSE, "house.css")


def policy_hash(text: str) -> str:
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
