"""What errors of force are ordered by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

Row = Mapping[str, Any]


def beyond_floor(rows: Sequence[Row]) -> bool:
    """Return whether rows are ranked by their errors beyond the floor: all have one."""
    return all(row["metric"] == "rmse" and row.get("reference_floor") is not None for row in rows)


def excess_of(row: Row) -> float:
    """Return a RMSE's mean square beyond the floor of its reference; of several replicates the median."""
    kept = row.get("replicates") or {}
    if "excess" in kept:
        return float(median(kept["excess"]))
    return float(row["score"] * row["score"] - row["reference_floor"] * row["reference_floor"])
