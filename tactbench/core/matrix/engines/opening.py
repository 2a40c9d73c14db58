"""Opening the engine asked for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tactbench.core.matrix.engines.limits import Limits


@contextmanager
def open_engine(name: str, jobs: int, limits: Limits, scheduler: str | None) -> Iterator[Any]:
    """Open the engine called `name`."""
    if name == "dask":
        from tactbench.core.matrix.engines.dask import open_dask

        with open_dask(scheduler, jobs, limits) as engine:
            yield engine
        return
    from tactbench.core.matrix.execution import workers

    with workers(jobs) as crew:
        yield crew
