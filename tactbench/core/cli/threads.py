"""How many threads numerical libraries may use."""

from __future__ import annotations

import os

from tactbench.core.thread_limit import VARIABLES


def keep_threads() -> None:
    """Keep numerical libraries at one thread, as the table's times state; before any is imported.

    Several threads would also sum in another order on another machine. Whoever sets these variables means it.
    """
    for name in VARIABLES:
        os.environ.setdefault(name, "1")
    # scikit-learn imports pandas where it is, pandas imports Arrow, and Arrow's allocator would start a thread of its
    # own: no numbers are computed in it, but a process with threads cannot fork its cells.
    os.environ.setdefault("JE_ARROW_MALLOC_CONF", "background_thread:false")
