"""What rigs let people check.

A simulated rig yields verdicts, each a number held against a known one; a rig of real devices says what a rig file
would let it do.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """One number held against the one that a law or a closed form gives."""

    name: str
    """What was computed, in one line: ``Hertz: depth under a paraboloid``."""
    found: float
    expected: float
    bound: float
    """Largest difference of the two that is allowed, included."""
    unit: str = "1"
    source: str = ""
    """The law, where it stands, and the reason for the bound."""

    def __post_init__(self) -> None:
        """Keep plain numbers: a NumPy scalar would be no JSON."""
        for name in ("found", "expected", "bound"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def met(self) -> bool:
        """Whether the two agree within the bound; not a number never does."""
        return abs(self.found - self.expected) <= self.bound


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
