"""Runs without child processes, for results that tests only look at."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

from tactbench.core.matrix.run import EngineChoice
from tactbench.core.pool import InProcess, Pool

IN_THIS_PROCESS = EngineChoice("in-process")


def make_here(patch: pytest.MonkeyPatch) -> None:
    """Have every process pool carry out its items in this process, and leave no bytecode of plugins that change."""
    patch.setattr(EngineChoice, "engine", lambda choice, jobs: InProcess())
    patch.setattr(EngineChoice, "recorder", lambda choice, computed: InProcess())
    patch.setattr(Pool, "each", lambda pool, work, items: InProcess().each(work, items))
    patch.setattr(sys, "dont_write_bytecode", True)


def forget(folders: Iterable[Path]) -> None:
    """Forget what this process has imported from `folders`, the recordings it has read and the sources it has seen."""
    from tactbench.core.matrix import solve
    from tactbench.core.provenance import source_digest

    solve._last.clear()
    solve._prepared.clear()
    source_digest.cache_clear()
    for folder in folders:
        for name, module in list(sys.modules.items()):
            if (getattr(module, "__file__", None) or "").startswith(f"{folder}{os.sep}"):
                del sys.modules[name]
