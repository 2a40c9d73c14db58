"""Names of the splits that train on a few sessions only."""

from __future__ import annotations

import re

_FEW_SHOT = re.compile(r"few-shot-([1-9][0-9]*)")


def shots(split: str) -> int | None:
    """Return how many training sessions a split named `few-shot-N` has; None if it is another."""
    found = _FEW_SHOT.fullmatch(split)
    return int(found[1]) if found else None
