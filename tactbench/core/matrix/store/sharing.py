"""What many rows have in common is written once, and is one object when it is read."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from tactbench.core.files import sha256
from tactbench.core.matrix.store.rows import Row

SHARED = (
    "plan", "assumptions", "remarks", "counts", "recordings", "digests", "classes", "stamps", "search", "params",
    "published_remark",
)  # fmt: skip
"""Keys of big values that many rows share."""
WORTH_CHARACTERS = 120
"""Shorter ones stay where they are: a reference has sixty."""

canonical = json.JSONEncoder(sort_keys=True).encode
"""Return plain data as one line of JSON: the same text for the same data."""


PROVENANCE_DIGITS = 16
"""Rows and files call a provenance by so many digits of the SHA-256 of its canonical text."""
_SHARED_DIGITS = 32
"""A value is shared under so many digits of that of its canonical text."""


def parted(row: Row) -> tuple[Row, dict[str, str], dict[str, str]]:
    """Return what a row has for itself, what it refers to, and the texts of that.

    Returns
    -------
    slim, references, texts
        The row without its big values; digest by key; canonical text by digest.
    """
    slim, references, texts = dict(row), {}, {}
    for key in SHARED:
        value = row.get(key)
        text = canonical(value) if isinstance(value, str | list | dict) else ""
        if len(text) >= WORTH_CHARACTERS:
            references[key] = sha256(text)[:_SHARED_DIGITS]
            texts[references[key]] = text
            del slim[key]
    return slim, references, texts


def joined(slim: Row, references: Mapping[str, str], shared: Mapping[str, Any]) -> Row:
    """Put the shared values back; KeyError if one is not there, or its key is none of `SHARED`."""
    if not references.keys() <= set(SHARED):
        raise KeyError(*references)
    return {**slim, **{key: shared[digest] for key, digest in references.items()}}


DEFINITION = '{{"shared": "{}", "value": {}}}'
"""A line that defines a shared value, of its digest and its text."""
_DEFINITION = re.compile(r'\{"shared": "([0-9a-f]{32})", "value": (.*)\}')


def definition(line: str) -> str | None:
    """Return the digest that a line defines if the line holds what the digest says, else None."""
    found = _DEFINITION.fullmatch(line)
    return found[1] if found is not None and sha256(found[2])[:_SHARED_DIGITS] == found[1] else None
