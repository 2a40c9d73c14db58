"""The estimators tactbench brings: descriptors here, code in the modules they name, reasons in docs/estimators.md."""

from __future__ import annotations

from tactbench.plugin import EstimatorDescriptor, Summary, hookimpl

TACTBENCH_API = 2

REGRESSION = ("regression",)
CLASSIFICATION = ("classification",)
BOTH = ("regression", "classification")
EVENTS = ("events",)

# k = 20 and lambda = 0.2 are what the paper's validation chose; the grid must hold them, and room on both sides.
WINDOWS = (0, 5, 10, 20, 40)
LAMBDAS = (0.01, 0.05, 0.1, 0.2, 0.3, 0.5)

TREES = (500, 100, 50, 10)
"""Forests of the ladder, and how many trees they have; the first is the paper's, and goes without a number."""


@hookimpl
def tactbench_estimators() -> list[EstimatorDescriptor]:
    """Offer the estimators."""
    return [*_trivial(), *_linear(), *_curved(), *_forests(), *_slip_detectors()]


def _trivial() -> list[EstimatorDescriptor]:
    return [
        EstimatorDescriptor(
            name="mean", title="Mean of the training labels", kinds=REGRESSION, looks_at="nothing", baseline=True,
            where="tactbench.estimators.trivial:mean", rehearsal={},
        ),
        EstimatorDescriptor(
            name="time-index", title="Linear regression on the time index (the paper's lower bound)", kinds=REGRESSION,
            looks_at="time", baseline=True, linear=True, where="tactbench.estimators.linear:least_squares",
            rehearsal={},
        ),
        EstimatorDescriptor(
            name="majority", title="Most frequent class of the training labels", kinds=CLASSIFICATION,
            looks_at="nothing", baseline=True, where="tactbench.estimators.trivial:majority", rehearsal={},
        ),
        EstimatorDescriptor(
            name="chance", title="A class drawn uniformly", kinds=CLASSIFICATION, looks_at="nothing", baseline=True,
            where="tactbench.estimators.trivial:chance", rehearsal={},
        ),
    ]  # fmt: skip


def _linear() -> list[EstimatorDescriptor]:
    return [
        EstimatorDescriptor(
            name="ols", title="Ordinary least squares on one sample", kinds=REGRESSION, linear=True,
            where="tactbench.estimators.linear:least_squares", rehearsal={},
        ),
        EstimatorDescriptor(
            name="lasso", title="Lasso on a mean-filtered window", kinds=REGRESSION, linear=True,
            params={"lambda_": 0.2}, grid={"lambda_": LAMBDAS}, window_grid=WINDOWS,
            where="tactbench.estimators.linear:lasso", rehearsal={},
        ),
        EstimatorDescriptor(
            name="ridge", title="Ridge regression on a mean-filtered window", kinds=REGRESSION, linear=True,
            params={"alpha": 1.0}, grid={"alpha": (0.01, 1.0, 100.0)}, window_grid=WINDOWS,
            where="tactbench.estimators.linear:ridge", rehearsal={},
        ),
        EstimatorDescriptor(
            name="logistic", title="Logistic regression", kinds=CLASSIFICATION, linear=True, params={"C": 1.0},
            where="tactbench.estimators.linear:logistic", rehearsal={},
        ),
        EstimatorDescriptor(
            name="lda", title="Linear discriminant analysis", kinds=CLASSIFICATION, linear=True,
            where="tactbench.estimators.linear:discriminant", rehearsal={},
        ),
    ]  # fmt: skip


def _curved() -> list[EstimatorDescriptor]:
    return [
        EstimatorDescriptor(
            name="knn", title="k nearest neighbours", kinds=BOTH, linear=False, params={"n_neighbors": 15},
            where="tactbench.estimators.nonlinear:neighbours", rehearsal={},
        ),
        EstimatorDescriptor(
            name="svm", title="Support vectors, Gaussian kernel, on every n-th row from 30 000 rows up", kinds=BOTH,
            linear=False, params={"C": 1.0, "gamma": "scale", "rows": 30_000},
            where="tactbench.estimators.nonlinear:support_vectors", rehearsal={},
        ),
        EstimatorDescriptor(
            name="boosting", title="Gradient boosting on histograms", kinds=BOTH, linear=False,
            params={"max_iter": 100, "learning_rate": 0.1, "max_leaf_nodes": 31},
            where="tactbench.estimators.nonlinear:boosting", rehearsal={"max_iter": 2},
        ),
        EstimatorDescriptor(
            name="mlp", title="Neural network with one hidden layer", kinds=BOTH, linear=False,
            params={"hidden": 64, "alpha": 1e-4, "max_iter": 200}, where="tactbench.estimators.nonlinear:perceptron",
            rehearsal={"max_iter": 2},
        ),
    ]  # fmt: skip


def _forests() -> list[EstimatorDescriptor]:
    found = [
        EstimatorDescriptor(
            name="extra-trees", title="Extremely randomised trees", kinds=BOTH, linear=False,
            params={"n_estimators": 200, "min_samples_leaf": 2}, where="tactbench.estimators.nonlinear:extra_trees",
            rehearsal={"n_estimators": 2},
        )
    ]  # fmt: skip
    for trees in TREES:
        number = "" if trees == TREES[0] else f"-{trees}"
        params = {"n_estimators": trees, "max_depth": None, "min_samples_leaf": 1}
        found += [
            EstimatorDescriptor(
                name=f"forest{number}", title=f"Random forest of {trees} trees", kinds=BOTH, linear=False,
                params=params, where="tactbench.estimators.nonlinear:forest", rehearsal={"n_estimators": 2},
            ),
            EstimatorDescriptor(
                name=f"forest-fast{number}", title=f"Random forest of {trees} trees by oneDAL (extra: fast)",
                kinds=BOTH, linear=False, params=params, where="tactbench.estimators.nonlinear:fast_forest",
                distributions=("scikit-learn-intelex", "daal"),
            ),
        ]  # fmt: skip
    return found


def _slip_detectors() -> list[EstimatorDescriptor]:
    code = "tactbench.estimators.slip_detectors"
    return [
        EstimatorDescriptor(
            name="slip-never", title="No frame slips", kinds=EVENTS, looks_at="nothing", baseline=True, threshold=0.5,
            where=f"{code}:never",
        ),
        EstimatorDescriptor(
            name="slip-always", title="Every frame slips", kinds=EVENTS, looks_at="nothing", baseline=True,
            threshold=0.5, where=f"{code}:always",
        ),
        EstimatorDescriptor(
            name="force-ratio", title="Tangential over friction times normal force, by the reference: an oracle",
            kinds=EVENTS, looks_at="reference", baseline=True, where=f"{code}:mean_feature",
        ),
        EstimatorDescriptor(
            name="pac-band", title="Energy of the vibration stream from 30 to 200 Hz", kinds=EVENTS,
            summaries=(Summary(measure="band-energy", band_hz=(30.0, 200.0), kinds=("ac_pressure",)),),
            where=f"{code}:mean_feature",
        ),
        EstimatorDescriptor(
            name="wavelet-energy", title="Wavelet details of the fastest stream (extra: wavelets)", kinds=EVENTS,
            frames_by=f"{code}:wavelet_amplitudes", where=f"{code}:mean_feature", distributions=("PyWavelets",),
        ),
        EstimatorDescriptor(
            name="frame-difference", title="Mean step of the taxels from sample to sample", kinds=EVENTS,
            summaries=(Summary(measure="mean-step", kinds=("taxel",)),), where=f"{code}:mean_feature",
        ),
        EstimatorDescriptor(
            name="slip-forest", title="Random forest on how much channels moved", kinds=EVENTS, linear=False,
            params={"n_estimators": 50, "min_samples_leaf": 5, "rows": 10_000}, where=f"{code}:forest",
            rehearsal={"n_estimators": 2},
        ),
        EstimatorDescriptor(
            name="slip-svm", title="Support vectors on how much channels moved", kinds=EVENTS, linear=False,
            params={"C": 1.0, "rows": 2_000}, where=f"{code}:support_vectors", rehearsal={},
        ),
        EstimatorDescriptor(
            name="slip-spectrum", title="Logistic regression on the spectrum of the fastest stream", kinds=EVENTS,
            linear=True, params={"C": 1.0, "rows": 10_000}, frames_by=f"{code}:spectrum", where=f"{code}:logistic",
            rehearsal={},
        ),
    ]  # fmt: skip
