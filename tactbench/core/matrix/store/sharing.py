"""What many rows have in common is written once, and is one object when it is read."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any

from tactbench.core.matrix.store.rows import Row

SHARED = (
    "plan", "assumptions", "remarks", "counts", "recordings", "digests", "classes", "stamps", "search", "params",
    "published_remark", "replicates/names", "replicates/strata",
)  # fmt: skip
"""Where big values that many rows share lie: a key of the row, or a key in one of its mappings."""
WORTH_CHARACTERS = 120
"""Shorter ones stay where they are: a reference has sixty."""

_SPLIT = tuple((place, *place.partition("/")[::2]) for place in SHARED)


canonical = json.JSONEncoder(sort_keys=True).encode
"""Return plain data as one line of JSON: the same text for the same data."""


def provenance_id(content: bytes) -> str:
    """Return what rows and files call a provenance by, from the bytes of its canonical text."""
    return hashlib.sha256(content).hexdigest()[:16]


def digest_of(text: str) -> str:
    """Return the name under which a value is shared, from its canonical text."""
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def parted(row: Row) -> tuple[Row, dict[str, str], dict[str, str]]:
    """Return what a row has for itself, where its shared values belong, and their texts.

    Returns
    -------
    slim, references, texts
        The row without its big values; digest by place; canonical text by digest.
    """
    slim, references, texts = dict(row), {}, {}
    for place, outer, inner in _SPLIT:
        holder = slim.get(outer)
        value = holder.get(inner) if inner and isinstance(holder, dict) else None if inner else holder
        if not value or not isinstance(value, str | list | dict):
            continue
        text = canonical(value)
        if len(text) < WORTH_CHARACTERS:
            continue
        references[place] = digest_of(text)
        texts[references[place]] = text
        if inner and isinstance(holder, dict):
            slim[outer] = {name: one for name, one in holder.items() if name != inner}
        else:
            del slim[outer]
    return slim, references, texts


def joined(slim: Row, references: Mapping[str, str], shared: Mapping[str, Any]) -> Row:
    """Put the shared values back; KeyError if one is not there."""
    for place, digest in references.items():
        outer, _, inner = place.partition("/")
        if inner:
            slim[outer][inner] = shared[digest]
        else:
            slim[outer] = shared[digest]
    return slim


_HEAD = '{"shared": "'
_MIDDLE = '", "value": '


def shared_lines(texts: dict[str, str]) -> Iterator[str]:
    """Yield the lines that define shared values."""
    for digest, text in texts.items():
        yield f"{_HEAD}{digest}{_MIDDLE}{text}}}"


def definition(line: str) -> str | None:
    """Return the digest that a line defines if the line holds what the digest says, else None."""
    start = len(_HEAD) + 32 + len(_MIDDLE)
    digest = line[len(_HEAD) : len(_HEAD) + 32]
    whole = line.startswith(_HEAD) and line[len(_HEAD) + 32 : start] == _MIDDLE and line.endswith("}")
    return digest if whole and digest_of(line[start:-1]) == digest else None
