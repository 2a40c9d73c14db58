"""Make features X and labels y of training, validation and test sets: tare, discard, scale and filter by protocol."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.dataset import Dataset, Mask, Table
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.splits import Assignment
from tactbench.core.samples import FloatArray, Fold, IntArray, Part
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.task import TaskSpec


def hold_s(meta: RecordingMeta) -> float:
    """Return the duration [s] of a recording's unloaded hold before the press; 0 if no such hold is stated.

    The recording's scene states the hold (:class:`ForceRamp.hold`). It is 0 for a recording without a scene, a clock
    or a hold at zero force, and is never inferred from readings.
    """
    if meta.scene is None or meta.clock == "none" or meta.scene.profile.corners[1][0] != 0:
        return 0.0
    return meta.scene.profile.hold_s


def unloaded(table: Table) -> npt.NDArray[np.bool_]:
    """Return an (n,) mask, True for rows in the recording's unloaded hold before the press."""
    return np.asarray(table.time_s < hold_s(table.meta))


def tared(table: Table) -> FloatArray:
    """Return (n, features) readings minus their mean over the recording's own unloaded hold.

    Rows after the hold have no influence on the mean; readings without a row in the hold are returned unchanged.
    """
    return less_rest(table.X, unloaded(table))


def less_rest(X: FloatArray, before: Mask) -> FloatArray:
    """Return (n, channels) readings minus their mean over the rows in the (n,) mask `before`, unless it is empty."""
    return X - X[before].mean(axis=0) if before.any() else X


def tare_s(data: Dataset) -> float:
    """Return the shortest unloaded hold [s] of all recordings; 0 if no recording states such a hold.

    Raises NotApplicable if only some recordings can be tared: tared and untared readings must not be mixed.
    """
    held = [hold_s(table.meta) if unloaded(table).any() else 0.0 for table in data.tables]
    if any(held) and not all(held):
        name = data.metas[held.index(0.0)].name
        raise NotApplicable(
            f"{sum(one > 0 for one in held)} of {len(held)} recordings state an unloaded hold to tare on; {name!r} "
            "states no such hold.",
            hint="Use protocol `deployable-untared`, which does not tare.",
        )
    return min(held, default=0.0)


@dataclass(frozen=True)
class FeatureScale:
    """Mean and standard deviation of each feature, by which readings are scaled."""

    mean: FloatArray
    deviation: FloatArray

    def __call__(self, X: FloatArray) -> FloatArray:
        """Return the z-scores of readings; exactly 0 for a feature whose deviation is 0, never NaN."""
        useful = self.deviation > 0
        return np.where(useful, (X - self.mean) / np.where(useful, self.deviation, 1.0), 0.0)


def moments(X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of (n,) numbers, or of each column of (…, columns), in two passes.

    The deviation of a constant column is exactly 0. It is decided by comparing minimum and maximum, because the
    computed deviation is the rounding error of the mean, which division would turn into a signal.
    """
    rows = tuple(range(max(X.ndim - 1, 1)))
    mean = X.mean(axis=rows)
    deviation = np.sqrt(((X - mean) ** 2).mean(axis=rows))
    return mean, np.where(X.max(axis=rows) > X.min(axis=rows), deviation, 0.0)


@dataclass(frozen=True)
class SetRows(Part):
    """The rows of one set before scaling, in order of recording and time."""

    labelled: Mask
    segment: IntArray
    """(n,) index of the run of rows to which each row belongs; mean filters never run across two runs."""


def keep(data: Dataset, protocol: ProtocolSpec, rows: Mask, what: str, counts: Counter[str]) -> SetRows:
    """Return the rows of a set that the protocol keeps; `rows` is the set's mask over all rows of `data`.

    Rows dropped by the three-sigma rule are counted in `counts`; `what` is the set's name in messages.
    """
    chosen = rows & data.column(lambda table: asked_for(table, protocol))
    if not chosen.any():
        raise DataError(f"The {what} set has no rows.", hint="Check roles, sessions and the length of the recordings.")
    X = data.column(lambda table: tared(table) if protocol.tare else table.X, chosen)
    recording, place = data.recording[chosen], np.flatnonzero(chosen)
    good = np.ones(len(X), dtype=bool)
    if protocol.three_sigma:
        force = data.column(lambda table: np.nan if table.force is None else table.force, chosen)
        good = _within_three_sigma(X, force, data.features, what, counts)
        if not good.any():
            raise DataError(
                f"The three-sigma rule of {protocol.name!r} drops all {len(X)} rows of the {what} set.",
                hint="Inspect the channels with `tactbench inspect`, or use protocol `deployable`.",
            )
    if protocol.window_over == "consecutive samples":
        # `place` does not count rows with a dropped-out channel: a filter in use skips such a row and goes on. A jump
        # in it is a row that belongs to another set.
        breaks = (np.diff(recording[good]) != 0) | (np.diff(place[good]) != 1)
        segment = np.append(0, np.cumsum(breaks))
    else:
        segment = recording[good]
    y, time_s, row, labelled = (
        data.column(attrgetter(name), chosen)[good] for name in ("y", "time_s", "row", "labelled")
    )
    return SetRows(X[good], y, time_s, recording[good], row, labelled, segment)


def asked_for(table: Table, protocol: ProtocolSpec) -> Mask:
    """Return an (n,) mask of the rows that the protocol keeps by their position in the recording."""
    if protocol.first_row_only:
        return np.asarray(np.arange(len(table.row)) == 0)
    return np.asarray((table.row >= protocol.discard_samples) & (table.time_s >= dropped_s(table.meta, protocol)))


def dropped_s(meta: RecordingMeta, protocol: ProtocolSpec) -> float:
    """Return the time [s] that the protocol drops at the start of a recording: the hold of the scene, or 0."""
    return meta.scene.profile.hold_s if protocol.discard_hold and meta.scene is not None else 0.0


def _within_three_sigma(
    X: FloatArray, force: FloatArray, features: Sequence[str], what: str, counts: Counter[str]
) -> Mask:
    """Return an (n,) mask, True for rows with all channels within three standard deviations of the channel's mean."""
    good = np.ones(len(X), dtype=bool)
    for name, column in (*zip(features, X.T, strict=True), ("force", force)):
        there = ~np.isnan(column)
        if not there.any():
            continue
        mean, deviation = moments(column[there])
        beyond = there & (np.abs(column - mean) > 3 * deviation) & (deviation > 0)
        if beyond.any():
            counts[f"{what} rows with {name} beyond three sigma"] += int(beyond.sum())
        good &= ~beyond
    return good


def part(kept: SetRows, scale: FeatureScale, k: int) -> Part:
    """Scale a set, filter it by a mean over `k` + 1 rows, and return its labelled rows."""
    return taken(replace(kept, X=causal_mean(scale(kept.X), k, kept.segment)), kept.labelled)


def taken(of: Part, rows: Mask | IntArray) -> Part:
    """Return the rows of a set that a mask or an array of indices selects."""
    return Part(**{column.name: getattr(of, column.name)[rows] for column in fields(Part)})


def scale_of(protocol: ProtocolSpec, train: SetRows, other: SetRows) -> FeatureScale:
    """Return the scale for a set: that of the training set, or the set's own if the protocol scales by each set."""
    return FeatureScale(*moments((other if protocol.scaled_by == "each set" else train).X))


def windowed(data: Dataset, task: TaskSpec, rules: ProtocolSpec, window: int, step: int) -> Dataset:
    """Return a data set with one row for each window of a recording, `X` (n, window, channels) in order of time.

    A window has `window` consecutive rows that the protocol keeps, tared if it tares, and the label of its last row.
    The next window ends `step` rows later. Raises NotApplicable if rows are not consecutive samples.
    """
    own = task.answer_per != "sample"
    if own or rules.three_sigma or rules.first_row_only or rules.k is not None:
        raise NotApplicable(
            f"window={window} needs consecutive single samples, which "
            f"{f'task {task.name!r}' if own else f'protocol {rules.name!r}'} does not use.",
            hint="Use protocol `deployable` and a task on single samples, or leave `window` out.",
        )

    def of(table: Table) -> Table:
        rows = asked_for(table, rules)
        last = np.flatnonzero(rows)[window - 1 :: step]
        X = np.zeros((0, window, table.X.shape[1]))
        if len(last):
            kept = (tared(table) if rules.tare else table.X)[rows]
            X = np.lib.stride_tricks.sliding_window_view(kept, window, axis=0)[::step].transpose(0, 2, 1)
        return replace(table.taken(last), X=X, readings=())

    return replace(data, tables=tuple(map(of, data.tables)))


def apart(fold: Assignment, data: Dataset, window: int, step: int) -> Assignment:
    """Return a fold without those training windows that share a row with a test window."""
    reach = (window - 1) // step
    near = [np.convolve(test, np.ones(2 * reach + 1))[reach : reach + len(test)] if len(test) else test
            for test in data.parted(fold.test)]  # fmt: skip
    return replace(fold, train=fold.train & (np.concatenate(near) < 0.5))


def prepared(assignment: Assignment, data: Dataset, rules: ProtocolSpec, k: int, counts: Counter[str]) -> Fold:
    """Return the sets of one fold, discarded and scaled by the protocol, and filtered by a mean over `k` + 1 samples.

    Rows left out, and features that are constant in training, are counted in `counts`.
    """
    train = keep(data, rules, assignment.train, "training", counts)
    for name, width in zip(data.features, np.ptp(train.X, axis=tuple(range(train.X.ndim - 1))), strict=True):
        if width == 0:
            counts[f"folds in which {name} never changes in training"] += 1

    def scaled(rows: Mask, what: str) -> Part:
        kept = keep(data, rules, rows, what, counts)
        return part(kept, scale_of(rules, train, kept), k)

    test = scaled(assignment.test, "test")
    validation = None if assignment.validation is None else scaled(assignment.validation, "validation")
    return Fold(assignment.name, part(train, scale_of(rules, train, train), k), test, validation)


def causal_mean(X: FloatArray, k: int, segment: npt.NDArray[np.integer]) -> FloatArray:
    """Return the (n, features) mean of each row with up to `k` rows before it in the same segment.

    `segment` has (n,) non-decreasing numbers. Sums are cumulative over centred columns: without centring, an offset of
    1e8 would leave an error of 1e-8 of its size in every difference of sums.
    """
    if k == 0 or len(X) == 0:
        return X
    centre = X.mean(axis=0)
    total = np.concatenate([np.zeros((1, X.shape[1])), np.cumsum(X - centre, axis=0)])
    here = np.arange(len(X))
    start = np.maximum(here - k, np.searchsorted(segment, segment))  # the first row of each one's segment
    return np.asarray((total[here + 1] - total[start]) / (here + 1 - start)[:, None] + centre)
