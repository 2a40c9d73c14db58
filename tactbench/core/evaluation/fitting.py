"""Teaching and asking an estimator, its warnings counted and its answers checked."""

from __future__ import annotations

import warnings
from collections import Counter
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, PluginContractError, TactbenchError
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import FloatArray


def fit(model: Estimator, X: FloatArray, y: npt.NDArray[Any], name: str, counts: Counter[str]) -> None:
    """Fit `model` to X (n, p) and y (n,) or (n, components).

    A warning (a solver that did not converge …) is counted under the estimator's `name` and stands in the row; on
    standard error nobody would connect it with a score.

    Raises
    ------
    DataError
        If the estimator refuses the data.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            model.fit(X, y)
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
            if isinstance(error, TactbenchError):
                raise
            raise DataError(
                f"The estimator {name!r} could not be fitted to {len(X)} rows of {X.shape[1]} features: {error}",
                hint="Check its parameters, or use another estimator.",
            ) from error
    for kind in sorted({warning.category.__name__ for warning in caught}):
        counts[f"fits of {name} with a {kind}"] += 1


def answers(
    model: Estimator, X: FloatArray, name: str, n_classes: int, components: tuple[int, ...] = ()
) -> npt.NDArray[Any]:
    """Return the answers of `model` to X (n, p): (n,) numbers, or class indices below `n_classes` unless it is 0.

    Parameters
    ----------
    components
        Shape of one answer: empty, or (d,) where it is a vector.

    Raises
    ------
    PluginContractError
        If it answers anything else.
    """
    predicted = model.predict(X)
    given = np.asarray(predicted)
    wrong = ""
    if np.ma.is_masked(predicted):
        wrong = f"{int(np.ma.getmaskarray(predicted).sum())} values that are masked"
    elif given.shape != (len(X), *components):
        wrong = f"shape {given.shape}"
    elif given.dtype.kind not in "biuf":
        wrong = f"values of type {given.dtype}"
    elif not np.isfinite(given).all():
        wrong = f"{np.count_nonzero(~np.isfinite(given))} values that are NaN or infinite"
    elif n_classes and not np.isin(given, np.arange(n_classes)).all():
        wrong = "classes that do not exist"
    if wrong:
        expected = f"class indices below {n_classes}" if n_classes else "finite numbers"
        raise PluginContractError(
            f"The estimator {name!r} answered {len(X)} rows with {wrong}.",
            hint=f"Its predict(X) must return {len(X)} {expected}, one for each row.",
        )
    return given.astype(np.int64 if n_classes else np.float64)
