"""How many cells may be at work at once on the machine that carries one out, where only the engine knows."""

from __future__ import annotations

_known: list[int] = []


def keep_company(cells: int) -> None:
    """Say in this process, forked for one cell, that up to `cells` are at work on this machine."""
    _known[:] = [cells]


def company(otherwise: int) -> int:
    """Return how many cells may be at work at once on this machine; `otherwise` where the engine has not said."""
    return _known[0] if _known else otherwise
