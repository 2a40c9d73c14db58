"""Random forests (Breiman 2001), as scikit-learn builds them."""

from __future__ import annotations

from typing import Any


def forest(
    *, kind: str, seed: int, threads: int, n_estimators: int, max_depth: int | None, min_samples_leaf: int
) -> Any:
    """Return a forest of `n_estimators` trees; the paper's curvature forest has 500."""
    from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor

    make = RandomForestClassifier if kind == "classification" else RandomForestRegressor
    return make(
        n_estimators=n_estimators, max_depth=max_depth, min_samples_leaf=min_samples_leaf, random_state=seed,
        n_jobs=threads,
    )  # fmt: skip
