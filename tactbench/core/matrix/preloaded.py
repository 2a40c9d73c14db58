"""Imported by a fork server: libraries and our own estimators are loaded once, before it forks."""

from tactbench.core.matrix.evaluate_cell import import_own_estimators

import_own_estimators()
