"""Imported by a fork server: libraries and our own estimators are loaded once, before it forks."""

from tactbench.core.matrix.evaluate_cell import import_estimators
from tactbench.core.plugins.registry import installed
from tactbench.core.thread_limit import find_libraries

import_estimators((estimator.name, kind) for estimator in installed().estimators for kind in estimator.kinds)
find_libraries()
