"""Detectors of slip, which give each frame a score that rises with the confidence in slip."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.estimators.nonlinear import EveryNth
from tactbench.plugin import NotApplicable, StreamReadings

if TYPE_CHECKING:
    import numpy.typing as npt

    from tactbench.plugin import FloatArray

LEVELS = 5
"""Largest number of levels of the wavelet transform: at 2.2 kHz they reach down to 34 Hz."""
WAVELET = "db2"
BANDS = 16
"""Number of bands of the spectrum."""


def always(*, kind: str, seed: int, threads: int) -> Any:
    """Return a detector that reports slip in every frame."""
    from sklearn.dummy import DummyRegressor

    return DummyRegressor(strategy="constant", constant=1.0)


def never(*, kind: str, seed: int, threads: int) -> Any:
    """Return a detector that never reports slip."""
    from sklearn.dummy import DummyRegressor

    return DummyRegressor(strategy="constant", constant=0.0)


class MeanFeature:
    """The mean of a frame's features, each scaled by the training frames."""

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> MeanFeature:
        """Learn nothing: the threshold is all there is to choose."""
        return self

    def predict(self, X: FloatArray) -> FloatArray:
        """Return (n,) means."""
        return np.asarray(X.mean(axis=1))


def mean_feature(*, kind: str, seed: int, threads: int) -> MeanFeature:
    """Return a detector without anything to learn but its threshold."""
    return MeanFeature()


class ClassifierDetector(EveryNth):
    """A classifier's confidence that a frame slips, learned from every n-th frame."""

    def predict(self, X: FloatArray) -> FloatArray:
        """Return (n,) confidences."""
        if hasattr(self.model, "decision_function"):
            return np.asarray(self.model.decision_function(X))
        return np.asarray(self.model.predict_proba(X)[:, 1])


def forest(
    *, kind: str, seed: int, threads: int, n_estimators: int, min_samples_leaf: int, rows: int
) -> ClassifierDetector:
    """Return a random forest that weighs both classes alike."""
    from sklearn.ensemble import RandomForestClassifier

    model = RandomForestClassifier(
        n_estimators=n_estimators, min_samples_leaf=min_samples_leaf, class_weight="balanced", random_state=seed
    )
    return ClassifierDetector(model, rows)


def support_vectors(*, kind: str, seed: int, threads: int, C: float, rows: int) -> ClassifierDetector:
    """Return support vectors with a Gaussian kernel that weigh both classes alike."""
    from sklearn.svm import SVC

    return ClassifierDetector(SVC(C=C, class_weight="balanced"), rows)


def logistic(*, kind: str, seed: int, threads: int, C: float, rows: int) -> ClassifierDetector:
    """Return a logistic regression that weighs both classes alike."""
    from sklearn.linear_model import LogisticRegression

    return ClassifierDetector(LogisticRegression(C=C, class_weight="balanced", max_iter=1000), rows)


def wavelet_amplitudes(stream: StreamReadings, ends_s: FloatArray, window_s: float) -> FloatArray:
    """Return (frames, levels) the root mean square of the wavelet details of each frame, over all channels.

    Raises
    ------
    NotApplicable
        If PyWavelets is not installed.
    """
    try:
        import pywt
    except ImportError as error:
        raise NotApplicable(
            "wavelet-energy needs PyWavelets, which is not installed.", hint="Install tactbench[wavelets]."
        ) from error
    windows = _windows(stream, ends_s, window_s)
    n = windows.shape[1]
    level = max(1, min(LEVELS, pywt.dwt_max_level(n, WAVELET)))
    details = pywt.wavedec(windows, WAVELET, mode="periodization", level=level, axis=1)[1:]
    return np.column_stack([np.sqrt((one**2).mean(axis=(1, 2))) for one in details])


def spectrum(stream: StreamReadings, ends_s: FloatArray, window_s: float) -> FloatArray:
    """Return (frames, bands) amplitudes of each frame under a Hann window, over all channels, in equal bands."""
    windows = _windows(stream, ends_s, window_s)
    n = windows.shape[1]
    power = np.abs(np.fft.rfft(windows * np.hanning(n + 2)[1:-1, None], axis=1)[:, 1:]) ** 2
    parts = np.array_split(power.mean(axis=2), min(BANDS, power.shape[1]), axis=1)
    return np.column_stack([np.sqrt(one.mean(axis=1)) for one in parts])


def _windows(stream: StreamReadings, ends_s: FloatArray, window_s: float) -> FloatArray:
    """Return (frames, samples, channels) the last samples up to each end, less their mean; NaN where there are fewer.

    As many as the window has at the stream's rate, two at least.
    """
    if stream.time_s is None or stream.rate_hz is None:
        raise NotApplicable(f"{stream.stream} has no clock.", hint="State the clock or the rate in the mapping.")
    n = max(2, int(window_s * stream.rate_hz + 1e-6))
    last = np.searchsorted(stream.time_s, ends_s, side="right")
    place = last[:, None] - n + np.arange(n)
    windows = stream.data[np.maximum(place, 0)]
    # A window that samples are missing from reaches further back than it should.
    begun = stream.time_s[np.maximum(place[:, 0], 0)]
    short = (place[:, 0] < 0) | (ends_s - begun > window_s + 1.5 / stream.rate_hz)
    windows = windows - windows.mean(axis=1, keepdims=True)
    windows[short] = np.nan
    return np.asarray(windows)
