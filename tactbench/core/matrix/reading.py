"""Reading files in a process of its own: whatever they do to the reader, they do not do it to the run."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from tactbench.core.matrix.engines.choice import EngineChoice

R = TypeVar("R")


def read_apart(read: Callable[[Path], R], paths: Sequence[Path], choice: EngineChoice) -> dict[Path, R | BaseException]:
    """Return what `read` makes of every path, or what stopped it there.

    One reused process reads one file after the other; a file that ends it, or takes longer than a cell may, costs its
    own result only.
    """
    if not paths:
        return {}
    importlib.import_module("h5py")  # once here, not once in every process that reads
    return dict(choice.pool(1).each(read, paths))
