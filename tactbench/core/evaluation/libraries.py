"""The libraries that every cell imports: loaded before processes are forked that share them."""

from __future__ import annotations

import importlib

EVERY_CELL = ("threadpoolctl", "scipy.special", "tactbench.core.evaluation.cell")
"""What holds an estimator to its threads, what knows Student's t, and what carries a cell out."""


def import_libraries() -> None:
    """Import them now, so that no forked cell imports them anew: neither its time nor its memory."""
    for name in EVERY_CELL:
        importlib.import_module(name)
