"""Numbers read off an answered cell."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactbench.core.errors import DataError
from tactbench.core.evaluation.cell import CellResult
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.calibration import Band, Output, Roughness
from tactbench.core.spec.recording import RecordingMeta


def thinned(data: Dataset, every: int) -> Dataset:
    """Return every `every`-th row of each recording; rows keep their index."""
    if every == 1:
        return data
    return replace(
        data,
        tables=tuple(
            replace(
                table,
                X=table.X[::every],
                y=table.y[::every],
                labelled=table.labelled[::every],
                force=None if table.force is None else table.force[::every],
                time_s=table.time_s[::every],
                row=table.row[::every],
                groups={name: column[::every] for name, column in table.groups.items()},
            )
            for table in data.tables
        ),
    )


def read_off(output: Output, result: CellResult, metas: Sequence[RecordingMeta]) -> float:
    """Return the number that `output` asks for.

    Raises
    ------
    DataError
        If it cannot be read off: a band without rows, fewer predictions than the lag needs.
    """
    answers = result.sets["test"]
    if isinstance(output.figure, Band):
        commanded = commanded_n(metas, answers.recording, answers.row)
        inside = (commanded >= output.figure.low_n) & (commanded < output.figure.high_n)
        if not inside.any():
            raise DataError(
                f"No test row of {output.name!r} has a commanded force from {output.figure.low_n:g} to "
                f"{output.figure.high_n:g} N.",
                hint="Widen the band, or thin the rows less.",
            )
        metric = metric_called(result.metric)
        return metric.of(answers.y_true[inside], answers.y_pred[inside], len(result.classes))
    if isinstance(output.figure, Roughness):
        return roughness(answers.y_pred, answers.recording, output.figure.lag)
    return result.score


def commanded_n(metas: Sequence[RecordingMeta], recording: IntArray, row: IntArray) -> FloatArray:
    """Return (n,) forces [N] that the scenes commanded at the rows: the label itself is too noisy to sort by.

    Raises
    ------
    DataError
        If a recording states no scene.
    """
    commanded = np.empty(len(row))
    for place in np.unique(recording):
        meta = metas[int(place)]
        if meta.scene is None:
            raise DataError(f"The recording {meta.name!r} states no scene.", hint="Calibrate with simulated rigs.")
        profile = meta.scene.profile
        here = recording == place
        times = row[here] * (profile.duration.to("s") / profile.samples)
        commanded[here] = np.interp(times, *profile.corners)
    return commanded


def roughness(predicted: FloatArray, recording: IntArray, lag: int) -> float:
    """Return the white noise of predictions (n,): rms of ``p[i] - 2 p[i+lag] + p[i+2 lag]`` over sqrt(6).

    A straight rise drops out, and the variance of the rest is six times that of one independent error. Rows of
    different recordings are never subtracted.

    Raises
    ------
    DataError
        If no recording has more than twice `lag` rows.
    """
    squares = total = 0.0
    for place in np.unique(recording):
        own = predicted[recording == place].astype(np.float64)
        bend = own[: -2 * lag] - 2 * own[lag:-lag] + own[2 * lag :]
        squares, total = squares + float(bend @ bend), total + bend.size
    if not total:
        raise DataError(f"No recording has {2 * lag + 1} predictions.", hint="Use a shorter lag.")
    return math.sqrt(squares / total / 6)
