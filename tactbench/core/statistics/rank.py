"""Ranks of cells as shown in tables; module `ranking`, which imports numpy, computes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Rank:
    """The rank of a cell, and the range of ranks that the data do not exclude."""

    place: int
    low: int | None
    """Best rank within the 95 % interval; None without an interval."""
    high: int | None
    """Worst rank within the 95 % interval; None without an interval."""
    tied: bool
    """True if another cell has the same rank."""
    behind: bool = False
    """True if the cell is clearly worse than the cell with the best score."""

    @property
    def unsure(self) -> bool:
        """True if another cell has the same rank, or the interval contains other ranks."""
        return self.tied or (self.low is not None and self.low != self.high)


def beyond_floor(rows: Sequence[Row]) -> bool:
    """Return True if rows are ranked by errors beyond the reference's noise floor: all have a RMSE and a floor."""
    return all(row["metric"] == "rmse" and row.get("reference_floor") is not None for row in rows)


def excess_of(row: Row) -> float:
    """Return the mean squared error minus the squared noise floor of the reference; the median over replicates."""
    kept = row.get("replicates") or {}
    if "excess" in kept:
        return float(median(kept["excess"]))
    return float(row["score"] * row["score"] - row["reference_floor"] * row["reference_floor"])
