"""Imported by a fork server: libraries, our own estimators and the twin are loaded once, before it forks."""

from tactbench.core.matrix.evaluate_cell import import_estimators
from tactbench.core.matrix.record import import_own_rigs
from tactbench.core.plugins.registry import installed
from tactbench.core.thread_limit import find_libraries

import_estimators((estimator.name, kind) for estimator in installed().estimators for kind in estimator.kinds)
import_own_rigs(("twin",))
find_libraries()
