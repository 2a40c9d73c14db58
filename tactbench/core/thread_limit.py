"""Limits on the number of threads of numerical libraries, which are cheap to set for every cell."""

from __future__ import annotations

import importlib
import os
import sys
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that numerical libraries read when they are loaded."""


def keep_threads() -> None:
    """Limit numerical libraries to one thread, as the table's times state; to be called before one is loaded.

    Several threads would also sum in another order on another machine. Variables that are set already are kept.
    """
    for name in VARIABLES:
        os.environ.setdefault(name, "1")
    # scikit-learn imports pandas where it is, pandas imports Arrow, and Arrow's allocator would start a thread of its
    # own: no numbers are computed in it, but a process with threads cannot fork its cells.
    os.environ.setdefault("JE_ARROW_MALLOC_CONF", "background_thread:false")


def thread_limit(threads: int) -> AbstractContextManager[Any]:
    """Return a context in which OpenMP and BLAS use at most `threads` threads.

    Finding the loaded libraries takes threadpoolctl about 2 ms, setting their threads some microseconds; they are
    looked for again after further imports.
    """
    limit: AbstractContextManager[Any] = _libraries(len(sys.modules)).limit(limits=threads)
    return limit


@lru_cache(maxsize=1)
def _libraries(modules: int) -> Any:
    """Return the numerical libraries of this process when it had imported so many modules."""
    return importlib.import_module("threadpoolctl").ThreadpoolController()
