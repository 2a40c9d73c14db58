"""Statuses of a cell: every planned cell ends as one row with one of them."""

from __future__ import annotations

from typing import Literal, get_args

Status = Literal["done", "failed", "crashed", "timeout", "out-of-memory", "skipped"]

STATUSES: tuple[Status, ...] = get_args(Status)

STOPPED: frozenset[Status] = frozenset({"failed", "crashed", "timeout", "out-of-memory"})
"""Statuses of cells that failed; one of them makes the exit code 1."""
