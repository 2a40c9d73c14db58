"""Ranks as tables show them; their computation, in `ranking`, loads numerics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Rank:
    """A place, and the places that the data do not exclude."""

    place: int
    low: int | None
    """best place that the 95 % interval holds; None without an interval"""
    high: int | None
    """worst place that it holds"""
    tied: bool
    """another cell has the same place"""
    behind: bool = False
    """clearly worse than the cell with the best score"""

    @property
    def unsure(self) -> bool:
        """Whether it shares its place, or might have another."""
        return self.tied or (self.low is not None and self.low != self.high)


def beyond_floor(rows: Sequence[Row]) -> bool:
    """Return whether rows are ranked by their errors beyond the floor: all have one."""
    return all(row["metric"] == "rmse" and row.get("reference_floor") is not None for row in rows)


def excess_of(row: Row) -> float:
    """Return a RMSE's mean square beyond the floor of its reference; of several replicates the median."""
    kept = row.get("replicates") or {}
    if "excess" in kept:
        return float(median(kept["excess"]))
    return float(row["score"] * row["score"] - row["reference_floor"] * row["reference_floor"])
