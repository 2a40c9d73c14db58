"""Reading recordings in a child process: whatever they do to the reader, they do not do it to the run."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path

from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.recorded import Recorded, stat_of
from tactbench.core.matrix.remembered import Facts


def read_all(
    read: Callable[[Path], Facts], paths: Sequence[Path], recorded: Recorded, choice: EngineChoice
) -> dict[Path, BaseException]:
    """Have `recorded` learn what `read` finds in every path; return what stopped it where it did.

    One child process reads one file after the other; a file that ends it, or takes longer than a cell may, costs its
    own result only.
    """
    if not paths:
        return {}
    importlib.import_module("h5py")  # once here, not once in every process that reads
    before = {path: stat_of(path) for path in paths}
    failed: dict[Path, BaseException] = {}
    for path, facts in choice.pool(1).each(read, paths):
        if isinstance(facts, BaseException):
            failed[path] = facts
        else:
            recorded.learn(path, facts, before[path])
    return failed
