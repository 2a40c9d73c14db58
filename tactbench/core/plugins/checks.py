"""What rigs let people check.

A simulated rig offers named checks that yield verdicts, each a number held against a range; a rig of real devices says
what a rig file would let it do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """One number held against the range it must lie in."""

    name: str
    """Short, lower case, unique within its check: ``depth at 64 x 64``."""
    found: float
    low: float
    """Lower end of the range, included; minus infinity where only the upper end counts."""
    high: float
    """Upper end of the range, included; infinity where only the lower end counts."""
    unit: str = "1"
    source: str = ""
    """Where the range comes from: a formula, a measurement, a reason for the bound."""
    note: str = ""
    """For a miss: its cause, as far as it is known."""

    def __post_init__(self) -> None:
        """Keep plain numbers: a NumPy scalar would be no JSON."""
        for name in ("found", "low", "high"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def met(self) -> bool:
        """Whether the number lies in its range; not a number never does."""
        return math.isfinite(self.found) and self.low <= self.found <= self.high


@dataclass(frozen=True)
class Check:
    """One thing that can be checked, not yet carried out."""

    name: str
    """Short and unique: ``hertz``."""
    group: str
    """What it belongs to: ``contact``, ``memory``, ``channels`` …"""
    title: str
    """One line: what is compared with what."""
    run: Callable[[], Sequence[Verdict]]
    """Carries it out; may take seconds."""


@dataclass(frozen=True)
class CheckTable:
    """Some of what a rig would do by its file."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    """As many texts each as there are in `head`."""


@dataclass(frozen=True)
class RigCheck:
    """What a rig would do by its file, and why it would not."""

    tables: tuple[CheckTable, ...]
    problems: tuple[str, ...]
    """Each a reason to refuse the file, with the next step; empty: it may be used."""
