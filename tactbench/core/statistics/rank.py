"""A rank, apart from what computes it, so that a table of stored results loads no numerics."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Rank:
    """A place, and the places that the data do not exclude."""

    place: int
    low: int | None
    """best place that the 95 % interval holds; None where no interval can be told"""
    high: int | None
    """worst place that it holds"""
    tied: bool
    """another cell has the same place"""
    apart: bool = False
    """clearly worse than the cell next before it"""
    behind: bool = False
    """clearly worse than the cell with the best score"""
    first_without: int = field(default=0, compare=False)
    """without how many replicates, each left out alone, it is the best, of equal cells the one first in order; 0 for
    all cells where replicates differ"""
