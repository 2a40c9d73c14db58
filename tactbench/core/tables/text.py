"""Escaping of control characters in texts from plugins and recordings, so that these can be printed."""

from __future__ import annotations

import json
import math
import shlex
from typing import Any


def visible(text: str) -> str:
    r"""Return `text` on one line, with every unprintable character written out as an escape.

    Control characters, marks that turn the direction of reading and lone surrogates become ``\x1b``, ``\u202e`` or
    ``\U000e0001``; line breaks, tabs and spaces of any width become one space each.
    """
    return text if text.isprintable() else "".join(map(_shown, text))


def visible_lines(text: str) -> str:
    """Return `text` with unprintable characters escaped as by `visible`; line breaks are kept."""
    return "\n".join(map(visible, text.split("\n")))


def _shown(character: str) -> str:
    if character.isprintable():
        return character
    return " " if character.isspace() else character.encode("unicode_escape").decode()


def command_line(*words: str) -> str:
    """Return the words as a shell command with quotes where needed; unprintable characters are escaped."""
    return visible(shlex.join(words))


def cut(text: str, most: int) -> str:
    """Return `text`, cut to `most` characters with an ellipsis at the end if it is longer."""
    return text if len(text) <= most else text[: most - 1] + "…"


def json_text(value: Any, **how: Any) -> str:
    """Return `value` as JSON of ASCII characters; NaN and infinity become null."""
    try:
        return json.dumps(value, allow_nan=False, **how)
    except ValueError:
        return json.dumps(_finite(value), allow_nan=False, **how)


def _finite(value: Any) -> Any:
    """Return `value` with None in place of NaN and infinity, in nested lists and dicts too."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return value
