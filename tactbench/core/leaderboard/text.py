"""Text from plugins, recordings and strangers' folders, made fit to be read: nothing in it acts on what shows it."""

from __future__ import annotations

import shlex
import unicodedata


def visible(text: str) -> str:
    r"""Return `text` on one line, every character that acts instead of showing written out as an escape.

    Control characters (the ESC that begins a terminal's commands), marks that turn the direction of reading, lone
    surrogates, private and unassigned characters become ``\x1b``, ``\u202e`` or ``\U000e0001``; line breaks, tabs and
    spaces of any width become one space each.
    """
    return text if text.isprintable() else "".join(map(_shown, text))


def _shown(character: str) -> str:
    if character.isprintable():
        return character
    if character in "\t\n\r\v\f\u2028\u2029" or unicodedata.category(character) == "Zs":
        return " "
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def command_line(*words: str) -> str:
    """Return a command as it is typed into a shell; a name that acts instead of showing is shown and not typed."""
    return visible(shlex.join(words))


def cut(text: str, most: int) -> str:
    """Return the first `most` characters of `text`, and an ellipsis where there are more."""
    return text if len(text) <= most else text[: most - 1] + "…"
