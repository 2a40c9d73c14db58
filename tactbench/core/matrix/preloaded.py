"""Imported by a fork server: libraries, our own estimators and the twin are loaded once, before it forks."""

import gc

gc.set_threshold(100_000, 50, 100)  # as in the command line's own process

from tactbench.core.matrix.evaluate_cell import import_estimators  # noqa: E402
from tactbench.core.matrix.record import import_own_rigs  # noqa: E402
from tactbench.core.plugins.registry import installed  # noqa: E402
from tactbench.core.thread_limit import find_libraries  # noqa: E402

import_estimators((estimator.name, kind) for estimator in installed().estimators for kind in estimator.kinds)
import_own_rigs(("twin",))
find_libraries()
