"""Work done once per process before times are measured: imports, and the first use of libraries."""

from __future__ import annotations

import importlib
import warnings
from typing import TYPE_CHECKING

from tactbench.core.thread_limit import thread_limit

if TYPE_CHECKING:
    from tactbench.core.plugins.interfaces import Estimator


def import_libraries() -> None:
    """Import the modules that every cell needs, so that processes forked later need not import them."""
    for name in ("threadpoolctl", "scipy.special", "tactbench.core.evaluation.cell"):
        importlib.import_module(name)


def rehearse(estimator: Estimator, kind: str) -> None:
    """Fit `estimator` to a few random rows for a task of this kind and predict, with one thread.

    Libraries delay some work (finding other libraries, generating code) until the first fit, where it takes some
    tenths of a second. Processes forked afterwards need not repeat this work.
    """
    import numpy as np

    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, 3))
    y = np.arange(len(X)) % 2 if kind != "regression" else X[:, 0] + rng.normal(size=len(X))
    with warnings.catch_warnings(), np.errstate(all="ignore"), thread_limit(1):
        warnings.simplefilter("ignore")
        estimator.fit(X, y)
        estimator.predict(X)
        estimator.predict(X[:1])
