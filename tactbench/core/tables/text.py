"""Escaping of control characters in texts from plugins and recordings, so that these can be printed."""

from __future__ import annotations

import json
import math
import re
import shlex
import unicodedata
from typing import Any

_ACTS = re.compile("[\x7f-\x9f\xad\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff]")
"""Characters to escape in JSON: control characters, marks of direction and lone surrogates."""


def visible(text: str) -> str:
    r"""Return `text` on one line, with every unprintable character written out as an escape.

    Control characters (the ESC that begins a terminal's commands), marks that turn the direction of reading, lone
    surrogates, private and unassigned characters become ``\x1b``, ``\u202e`` or ``\U000e0001``; line breaks, tabs and
    spaces of any width become one space each.
    """
    return text if text.isprintable() else "".join(map(_shown, text))


def visible_lines(text: str) -> str:
    """Return `text` with unprintable characters escaped as by `visible`; line breaks are kept."""
    return "\n".join(map(visible, text.split("\n")))


def _shown(character: str) -> str:
    if character.isprintable():
        return character
    if character in "\t\n\r\v\f\u2028\u2029" or unicodedata.category(character) == "Zs":
        return " "
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def command_line(*words: str) -> str:
    """Return the words as a shell command with quotes where needed; unprintable characters are escaped."""
    return visible(shlex.join(words))


def cut(text: str, most: int) -> str:
    """Return `text`, cut to `most` characters with an ellipsis at the end if it is longer."""
    return text if len(text) <= most else text[: most - 1] + "…"


def json_text(value: Any, **how: Any) -> str:
    """Return `value` as JSON: control characters and lone surrogates are escaped; NaN and infinity become null."""
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False, **how)
    except ValueError:
        text = json.dumps(_finite(value), ensure_ascii=False, allow_nan=False, **how)
    if text.isascii() and "\x7f" not in text:
        return text
    return _ACTS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def _finite(value: Any) -> Any:
    """Return `value` with None in place of NaN and infinity, in nested lists and dicts too."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return value
