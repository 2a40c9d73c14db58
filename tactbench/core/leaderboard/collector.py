"""Python's search for garbage, at rest while a large table is made."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def collector_at_rest() -> Iterator[None]:
    """Keep Python from searching a million living objects for dead ones, again and again: a third of the time.

    Memory that nobody refers to is freed as ever; only circles of objects wait until the end.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()
