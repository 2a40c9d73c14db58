"""Limits on the number of threads of numerical libraries, cheap enough to be set for every cell."""

from __future__ import annotations

import importlib
import os
import sys
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that numerical libraries read when they are loaded, by name."""


def keep_threads() -> None:
    """Limit numerical libraries to one thread, as the published times assume; to be called before a library is loaded.

    With several threads, sums would depend on the machine. Environment variables that are already set are kept.
    """
    for name in VARIABLES:
        os.environ.setdefault(name, "1")
    # scikit-learn imports pandas where it is, pandas imports Arrow, and Arrow's allocator would start a thread of its
    # own: no numbers are computed in it, but a process with threads cannot fork its cells.
    os.environ.setdefault("JE_ARROW_MALLOC_CONF", "background_thread:false")


def thread_limit(threads: int) -> AbstractContextManager[Any]:
    """Return a context in which OpenMP and BLAS use at most `threads` threads.

    Finding the loaded libraries takes threadpoolctl about 2 ms, setting their threads a few microseconds; libraries are
    searched again after further imports.
    """
    limit: AbstractContextManager[Any] = _libraries(len(sys.modules)).limit(limits=threads)
    return limit


@lru_cache(maxsize=1)
def _libraries(modules: int) -> Any:
    """Return the loaded numerical libraries; `modules`, the number of imported modules, is the key of a cache."""
    return importlib.import_module("threadpoolctl").ThreadpoolController()
