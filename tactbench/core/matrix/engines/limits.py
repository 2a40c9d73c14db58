"""What a cell may take."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Bounds that end a cell which passes them; None is no bound."""

    timeout_s: float | None = None
    """Wall clock, s."""
    memory_mb: int | None = None
    """Memory that a cell may take beyond what it starts with, MB."""
