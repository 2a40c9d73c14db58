"""How a cell ends: every planned cell ends as exactly one row, and its row says which of these."""

from __future__ import annotations

from typing import Literal, get_args

Status = Literal["done", "failed", "crashed", "timeout", "out-of-memory", "skipped"]

STATUSES: tuple[Status, ...] = get_args(Status)

STOPPED: frozenset[Status] = frozenset({"failed", "crashed", "timeout", "out-of-memory"})
"""Cells that should have ended otherwise: one of these makes the exit code 1."""
