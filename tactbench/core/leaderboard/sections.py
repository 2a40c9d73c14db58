"""Tables that stand below a leaderboard's blocks and are no part of any ranking."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """A table of plain text."""

    title: str
    columns: tuple[str, ...]
    numeric: frozenset[str]
    """Columns aligned to the right."""
    lines: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    alarms: frozenset[int] = frozenset()
    """Lines that a reader should look at first."""
    detail: bool = False
    """Whether it only gives details of what stands in the blocks, and is printed with them all."""
