"""A figure of a report: drawn, saved, and what it shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class SavedFigure:
    """One figure."""

    name: str
    """Short, fit for a file name and an anchor: ``force-against-time``."""
    title: str
    caption: str
    """What is on the axes and how to read it, in sentences a paper could use."""
    png: Path
    pdf: Path
    keys: tuple[str, ...]
    """Keys of the cells it shows."""
