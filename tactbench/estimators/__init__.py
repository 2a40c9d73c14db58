"""Descriptors of the estimators that this package provides (reasons for their choice: ``docs/estimators.md``)."""

from __future__ import annotations

from typing import Any

from tactbench.plugin import EstimatorDescriptor, Summary, hookimpl

TACTBENCH_API = 2

REGRESSION = ("regression",)
CLASSIFICATION = ("classification",)
BOTH = ("regression", "classification")

# k = 20 and lambda = 0.2 are what the paper's validation chose; the grid must hold them, and room on both sides.
WINDOWS = (0, 5, 10, 20, 40)
LAMBDAS = (0.01, 0.05, 0.1, 0.2, 0.3, 0.5)

TREES = (500, 100, 50, 10)
"""Numbers of trees of the offered random forests; the first, 500, is that of Karl et al. 2016."""


@hookimpl
def tactbench_estimators() -> list[EstimatorDescriptor]:
    """Return the descriptors of the estimators that this package provides."""
    nothing: dict[str, Any] = {"looks_at": "nothing", "baseline": True}
    return [
        _estimator("mean", "Mean of the training labels", REGRESSION, "models:mean", **nothing),
        _estimator(
            "time-index", "Linear regression on the time index (the paper's lower bound)", REGRESSION,
            "models:least_squares", looks_at="time", baseline=True, linear=True,
        ),
        _estimator(
            "majority", "Most frequent class of the training labels", CLASSIFICATION, "models:majority", **nothing
        ),
        _estimator("chance", "A class drawn uniformly", CLASSIFICATION, "models:chance", **nothing),
        _estimator("ols", "Ordinary least squares on one sample", REGRESSION, "models:least_squares", linear=True),
        _estimator(
            "lasso", "Lasso on a mean-filtered window", REGRESSION, "models:lasso", linear=True,
            params={"lambda_": 0.2}, grid={"lambda_": LAMBDAS}, window_grid=WINDOWS,
        ),
        _estimator(
            "ridge", "Ridge regression on a mean-filtered window", REGRESSION, "models:ridge", linear=True,
            params={"alpha": 1.0}, grid={"alpha": (0.01, 1.0, 100.0)}, window_grid=WINDOWS,
        ),
        _estimator(
            "logistic", "Logistic regression", CLASSIFICATION, "models:logistic", linear=True, params={"C": 1.0}
        ),
        _estimator("lda", "Linear discriminant analysis", CLASSIFICATION, "models:discriminant", linear=True),
        _estimator(
            "knn", "k nearest neighbours", BOTH, "models:neighbours", linear=False, params={"n_neighbors": 15}
        ),
        _estimator(
            "svm", "Support vectors, Gaussian kernel, on every n-th row from 30 000 rows up", BOTH,
            "models:support_vectors", linear=False, params={"C": 1.0, "gamma": "scale", "rows": 30_000},
        ),
        _estimator(
            "boosting", "Gradient boosting on histograms", BOTH, "models:boosting", linear=False,
            params={"max_iter": 100, "learning_rate": 0.1, "max_leaf_nodes": 31}, rehearsal={"max_iter": 2},
        ),
        _estimator(
            "mlp", "Neural network with one hidden layer", BOTH, "models:perceptron", linear=False,
            params={"hidden": 64, "alpha": 1e-4, "max_iter": 200}, rehearsal={"max_iter": 2},
        ),
        _estimator(
            "extra-trees", "Extremely randomised trees", BOTH, "models:extra_trees", linear=False,
            params={"n_estimators": 200, "min_samples_leaf": 2}, rehearsal={"n_estimators": 2},
        ),
        *(
            _estimator(
                "forest" if trees == TREES[0] else f"forest-{trees}", f"Random forest of {trees} trees", BOTH,
                "models:forest", linear=False, rehearsal={"n_estimators": 2},
                params={"n_estimators": trees, "max_depth": None, "min_samples_leaf": 1},
            )
            for trees in TREES
        ),
        *_slip_detectors(),
    ]  # fmt: skip


def _estimator(name: str, title: str, kinds: tuple[str, ...], where: str, **more: Any) -> EstimatorDescriptor:
    """Return an estimator's descriptor; by default a rehearsal runs the estimator with its usual parameters."""
    fields = {"name": name, "title": title, "kinds": kinds, "where": f"tactbench.estimators.{where}", "rehearsal": {}}
    return EstimatorDescriptor.model_validate(fields | more)


def _slip_detectors() -> list[EstimatorDescriptor]:
    def detector(name: str, title: str, where: str, **more: Any) -> EstimatorDescriptor:
        return _estimator(name, title, ("events",), f"slip_detectors:{where}", **{"rehearsal": None, **more})

    trivial = {"looks_at": "nothing", "baseline": True, "threshold": 0.5}
    band = Summary(measure="band-energy", band_hz=(30.0, 200.0), kinds=("ac_pressure",))
    return [
        detector("slip-never", "No frame slips", "never", **trivial),
        detector("slip-always", "Every frame slips", "always", **trivial),
        detector(
            "force-ratio", "Tangential over friction times normal force, by the reference: an oracle", "mean_feature",
            looks_at="reference", baseline=True,
        ),
        detector(
            "pac-band", "Energy of the vibration stream from 30 to 200 Hz", "mean_feature", summaries=(band,)
        ),
        detector(
            "wavelet-energy", "Wavelet details of the fastest stream (extra: wavelets)", "mean_feature",
            frames_by="tactbench.estimators.slip_detectors:wavelet_amplitudes", distributions=("PyWavelets",),
        ),
        detector(
            "frame-difference", "Mean step of the taxels from sample to sample", "mean_feature",
            summaries=(Summary(measure="mean-step", kinds=("taxel",)),),
        ),
        detector(
            "slip-forest", "Random forest on how much channels moved", "forest", linear=False,
            params={"n_estimators": 50, "min_samples_leaf": 5, "rows": 10_000}, rehearsal={"n_estimators": 2},
        ),
        detector(
            "slip-svm", "Support vectors on how much channels moved", "support_vectors", linear=False,
            params={"C": 1.0, "rows": 2_000}, rehearsal={},
        ),
        detector(
            "slip-spectrum", "Logistic regression on the spectrum of the fastest stream", "logistic", linear=True,
            params={"C": 1.0, "rows": 10_000}, frames_by="tactbench.estimators.slip_detectors:spectrum", rehearsal={},
        ),
    ]  # fmt: skip
