"""The estimators tactbench brings: descriptors here, code in the modules they name."""

from __future__ import annotations

from tactbench.plugin import EstimatorDescriptor, hookimpl

TACTBENCH_API = 1

REGRESSION = ("regression",)
CLASSIFICATION = ("classification",)
BOTH = ("regression", "classification")

# k = 20 and lambda = 0.2 are what the paper's validation chose; the grid must hold them, and room on both sides.
WINDOWS = (0, 5, 10, 20, 40)
LAMBDAS = (0.01, 0.05, 0.1, 0.2, 0.3, 0.5)


@hookimpl
def tactbench_estimators() -> list[EstimatorDescriptor]:
    """Offer the estimators."""
    return [
        EstimatorDescriptor(
            name="mean", title="Mean of the training labels", kinds=REGRESSION, looks_at="nothing", baseline=True,
            where="tactbench.estimators.trivial:mean",
        ),
        EstimatorDescriptor(
            name="time-index", title="Linear regression on the time index (the paper's lower bound)", kinds=REGRESSION,
            looks_at="time", baseline=True, linear=True, where="tactbench.estimators.linear:least_squares",
        ),
        EstimatorDescriptor(
            name="majority", title="Most frequent class of the training labels", kinds=CLASSIFICATION,
            looks_at="nothing", baseline=True, where="tactbench.estimators.trivial:majority",
        ),
        EstimatorDescriptor(
            name="chance", title="A class drawn uniformly", kinds=CLASSIFICATION, looks_at="nothing", baseline=True,
            where="tactbench.estimators.trivial:chance",
        ),
        EstimatorDescriptor(
            name="lasso", title="Lasso on a mean-filtered window", kinds=REGRESSION, linear=True,
            params={"lambda_": 0.2}, grid={"lambda_": LAMBDAS}, window_grid=WINDOWS,
            where="tactbench.estimators.linear:lasso",
        ),
        EstimatorDescriptor(
            name="ridge", title="Ridge regression on a mean-filtered window", kinds=REGRESSION, linear=True,
            params={"alpha": 1.0}, grid={"alpha": (0.01, 1.0, 100.0)}, window_grid=WINDOWS,
            where="tactbench.estimators.linear:ridge",
        ),
        EstimatorDescriptor(
            name="logistic", title="Logistic regression", kinds=CLASSIFICATION, linear=True, params={"C": 1.0},
            where="tactbench.estimators.linear:logistic",
        ),
        EstimatorDescriptor(
            name="forest", title="Random forest", kinds=BOTH, linear=False, where="tactbench.estimators.forest:forest",
            params={"n_estimators": 500, "max_depth": None, "min_samples_leaf": 1},
        ),
    ]  # fmt: skip
