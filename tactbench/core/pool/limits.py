"""How much an item of work may take."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """What one item, a cell or a recording, may take; None: no limit."""

    timeout_s: float | None = None
    """Seconds by the wall."""
    memory_mb: int | None = None
    """MB (2**20 bytes) beyond what all items share: libraries and recordings that were read before it began."""
    grace_s: float = 0.0
    """Seconds between being asked to end and being ended: a real device has to be closed."""


UNLIMITED = Limits()
