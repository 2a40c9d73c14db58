"""Slip detectors, which give each frame a score that rises with the confidence that the contact slips."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.estimators.models import EveryNth
from tactbench.plugin import FloatArray, NotApplicable, StreamReadings

LEVELS = 5
"""Largest number of levels of the wavelet transform: five levels reach down to 34 Hz at a rate of 2.2 kHz."""
WAVELET = "db2"
BANDS = 16
"""Number of frequency bands, of equal width, into which the spectrum is divided."""


def always(*, kind: str, seed: int, threads: int) -> Any:
    """Return a detector that reports slip in every frame."""
    return _constant(1.0)


def never(*, kind: str, seed: int, threads: int) -> Any:
    """Return a detector that never reports slip."""
    return _constant(0.0)


def _constant(answer: float) -> Any:
    from sklearn.dummy import DummyRegressor

    return DummyRegressor(strategy="constant", constant=answer)


class MeanFeature:
    """Detector whose score is the mean of a frame's features, each scaled by the training frames."""

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> MeanFeature:
        """Do nothing: only the threshold, chosen elsewhere, depends on the training data."""
        return self

    def predict(self, X: FloatArray) -> FloatArray:
        """Return the (n,) means over the features of each row of X (n, p)."""
        return np.asarray(X.mean(axis=1))


def mean_feature(*, kind: str, seed: int, threads: int) -> MeanFeature:
    """Return a detector by the mean of a frame's features; only its threshold depends on the training data."""
    return MeanFeature()


class ClassifierDetector(EveryNth):
    """Detector by a classifier's confidence that a frame slips; the classifier is trained on every n-th frame."""

    def predict(self, X: FloatArray) -> FloatArray:
        """Return the (n,) confidences that the frames X (n, p) slip."""
        if hasattr(self.model, "decision_function"):
            return np.asarray(self.model.decision_function(X))
        return np.asarray(self.model.predict_proba(X)[:, 1])


def forest(*, kind: str, seed: int, threads: int, rows: int, **params: Any) -> ClassifierDetector:
    """Return a random forest with equal weights of both classes, slip and no slip."""
    from sklearn.ensemble import RandomForestClassifier

    return ClassifierDetector(RandomForestClassifier(class_weight="balanced", random_state=seed, **params), rows)


def support_vectors(*, kind: str, seed: int, threads: int, rows: int, **params: Any) -> ClassifierDetector:
    """Return a support vector machine with a Gaussian kernel and equal weights of both classes, slip and no slip."""
    from sklearn.svm import SVC

    return ClassifierDetector(SVC(class_weight="balanced", **params), rows)


def logistic(*, kind: str, seed: int, threads: int, rows: int, **params: Any) -> ClassifierDetector:
    """Return a logistic regression with equal weights of both classes, slip and no slip."""
    from sklearn.linear_model import LogisticRegression

    return ClassifierDetector(LogisticRegression(class_weight="balanced", max_iter=1000, **params), rows)


def wavelet_amplitudes(stream: StreamReadings, ends_s: FloatArray, window_s: float) -> FloatArray:
    """Return (frames, levels) root mean squares, over all channels, of the wavelet details in each frame.

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
    """Return (frames, bands) spectral amplitudes over all channels, with a Hann window, in bands of equal width."""
    windows = _windows(stream, ends_s, window_s)
    n = windows.shape[1]
    power = np.abs(np.fft.rfft(windows * np.hanning(n + 2)[1:-1, None], axis=1)[:, 1:]) ** 2
    parts = np.array_split(power.mean(axis=2), min(BANDS, power.shape[1]), axis=1)
    return np.column_stack([np.sqrt(one.mean(axis=1)) for one in parts])


def _windows(stream: StreamReadings, ends_s: FloatArray, window_s: float) -> FloatArray:
    """Return (frames, samples, channels): the last samples before each frame's end, less their mean; NaN if too few.

    The number of samples is that of the window at the stream's rate, at least two.
    """
    if stream.time_s is None or stream.rate_hz is None:
        raise NotApplicable(f"{stream.stream} has no time stamps.", hint="State its clock or rate in the mapping.")
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
