"""The first use of a library, before any clock is read."""

from __future__ import annotations

import warnings

import numpy as np

from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.thread_limit import thread_limit

_ROWS, _FEATURES = 40, 3


def rehearse(estimator: Estimator, kind: str) -> None:
    """Have `estimator` learn and answer a few made-up rows of a question of this kind, with one thread.

    What a library puts off until its first fit (looking for other libraries, generating code) takes it up to some
    tenths of a second. Processes forked from here need not do it again.
    """
    rng = np.random.default_rng(0)
    X = rng.normal(size=(_ROWS, _FEATURES))
    y = np.arange(_ROWS) % 2 if kind != "regression" else X[:, 0] + rng.normal(size=_ROWS)
    with warnings.catch_warnings(), np.errstate(all="ignore"), thread_limit(1):
        warnings.simplefilter("ignore")
        estimator.fit(X, y)
        estimator.predict(X)
        estimator.predict(X[:1])
