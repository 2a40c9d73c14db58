"""Runs without child processes, for results that tests only look at.

Recordings that were read are remembered by their paths: other ones at the same paths need another run's way.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.pool.in_process import InProcess
from tactbench.core.pool.pool import Pool


class InThisProcess(EngineChoice):
    """Answers in this process, however many cells there are."""

    def engine(self, cells):
        return InProcess(self.limits)


IN_THIS_PROCESS = InThisProcess("in-process")


def make_here(patch: pytest.MonkeyPatch) -> None:
    """Have every process pool carry out its items in this process, and leave no bytecode of plugins that change."""
    patch.setattr(Pool, "each", lambda pool, work, items: InProcess(pool.limits).each(work, items))
    patch.setattr(sys, "dont_write_bytecode", True)


def forget(folders: Iterable[Path]) -> None:
    """Forget what this process has imported from `folders`, the recordings it has read and the rigs it has built."""
    from tactbench.core.matrix import evaluate_cell, record

    evaluate_cell.dataset.cache_clear()
    record._rig.cache_clear()
    for folder in folders:
        for name, module in list(sys.modules.items()):
            if (getattr(module, "__file__", None) or "").startswith(f"{folder}{os.sep}"):
                del sys.modules[name]
