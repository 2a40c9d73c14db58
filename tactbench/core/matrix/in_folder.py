"""A cell in a child process of a Dask worker. Apart, since whoever imports `distributed` with it takes a second."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any


def in_folder(folder: str, concurrency: int, work: Callable[..., Any], item: Any) -> Any:
    """Return `work(item, concurrency=concurrency)`, done in `folder`: relative paths count from the run's."""
    os.chdir(folder)
    return work(item, concurrency=concurrency)
