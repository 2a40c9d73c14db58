"""From masks to X and y: what the protocol discards, scales and filters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset, Table
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.unloaded import tared
from tactbench.core.evaluation.windows import causal_mean
from tactbench.core.samples import FloatArray, IntArray, Part

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class FeatureScale:
    """Mean and deviation of each feature."""

    mean: FloatArray
    deviation: FloatArray

    @classmethod
    def of(cls, X: FloatArray) -> FeatureScale:
        """Measure `X`."""
        return cls(*moments(X))

    def __call__(self, X: FloatArray) -> FloatArray:
        """Return z-scores; a feature that was constant where the scale was measured becomes exactly 0, never NaN."""
        useful = self.deviation > 0
        return np.where(useful, (X - self.mean) / np.where(useful, self.deviation, 1.0), 0.0)


def moments(X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and deviation of each column in two passes, the deviation of a constant column exactly zero.

    A constant column's computed deviation is the rounding error of its mean, as large as the number of rows makes it;
    it would turn rounding into a signal. So constancy is looked up, not inferred from the deviation.
    """
    mean = np.asarray(X.mean(axis=0))
    deviation = np.sqrt(((X - mean) ** 2).mean(axis=0))
    return mean, np.where(X.max(axis=0) > X.min(axis=0), deviation, 0.0)


@dataclass(frozen=True)
class SetRows:
    """The rows of one set before scaling, in order of recording and time."""

    X: FloatArray
    y: npt.NDArray[np.float64]
    labelled: Mask
    time_s: FloatArray
    recording: IntArray
    row: IntArray
    cluster: IntArray
    segment: IntArray
    """Windows stay within one number."""


def keep(data: Dataset, protocol: ProtocolSpec, masks: Sequence[Mask], what: str, counts: Counter[str]) -> SetRows:
    """Collect the rows of a set and drop what the protocol drops.

    Parameters
    ----------
    masks
        One (n,) mask a recording.
    what
        Name of the set, for messages.
    counts
        Told how many rows the three-sigma rule drops, which depends on the set.

    Raises
    ------
    DataError
        If no row is left.
    """
    chosen = [mask & asked_for(table, protocol) for table, mask in zip(data.tables, masks, strict=True)]
    sizes = [int(mask.sum()) for mask in chosen]
    if sum(sizes) == 0:
        raise DataError(f"The {what} set has no rows.", hint="Check roles, sessions and the length of the recordings.")
    tables = data.tables
    readings = [tared(table) if protocol.tare else table.X for table in tables]
    X = np.concatenate([column[mask] for column, mask in zip(readings, chosen, strict=True)])
    recording = np.repeat(np.arange(len(tables)), sizes)
    row = np.concatenate([table.row[mask] for table, mask in zip(tables, chosen, strict=True)])
    place = np.concatenate([np.flatnonzero(mask) for mask in chosen])
    good = np.ones(len(X), dtype=bool)
    if protocol.three_sigma:
        forces = [np.full(len(table.row), np.nan) if table.force is None else table.force for table in tables]
        force = np.concatenate([column[mask] for column, mask in zip(forces, chosen, strict=True)])
        good = _within_three_sigma(X, force, data.features, what, counts)
        if not good.any():
            raise DataError(
                f"The three-sigma rule of {protocol.name!r} leaves none of the {len(X)} rows of the {what} set.",
                hint="Look at its channels with `tactbench inspect`, or use --protocol deployable.",
            )
    sessions = {name: place for place, name in enumerate(sorted({meta.session for meta in data.metas}))}
    cluster = np.repeat([sessions[meta.session] for meta in data.metas], sizes)
    consecutive = protocol.window_over == "consecutive samples"
    return SetRows(
        X=X[good],
        y=np.concatenate([table.y[mask] for table, mask in zip(tables, chosen, strict=True)])[good],
        labelled=np.concatenate([table.labelled[mask] for table, mask in zip(tables, chosen, strict=True)])[good],
        time_s=np.concatenate([table.time_s[mask] for table, mask in zip(tables, chosen, strict=True)])[good],
        recording=recording[good],
        row=row[good],
        cluster=cluster[good],
        segment=_segments(recording[good], place[good], consecutive=consecutive),
    )


def not_asked_for(data: Dataset, protocol: ProtocolSpec, used: Sequence[Mask]) -> dict[str, int]:
    """Return how many of the rows that some fold uses the protocol does not look at, by reason.

    Parameters
    ----------
    used
        One (n,) mask a recording.
    """
    others = sum(int((mask & ~asked_for(table, protocol)).sum()) for table, mask in zip(data.tables, used, strict=True))
    which = "after the first of a recording" if protocol.first_row_only else "before the press begins"
    return {f"rows {which}": others} if others else {}


def asked_for(table: Table, protocol: ProtocolSpec) -> Mask:
    """Return (n,) which rows the protocol looks at, by their place in the recording."""
    if protocol.first_row_only:
        return np.asarray(np.arange(len(table.row)) == 0)
    started: Mask = table.row >= protocol.discard_samples
    if protocol.discard_hold and table.meta.scene is not None:
        started = started & (table.time_s >= table.meta.scene.profile.hold.to("s"))
    return started


def _within_three_sigma(
    X: FloatArray, force: FloatArray, features: Sequence[str], what: str, counts: Counter[str]
) -> Mask:
    """Return which rows have every channel within three standard deviations of that channel's mean in this set."""
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


def _segments(recording: IntArray, place: IntArray, *, consecutive: bool) -> IntArray:
    """Return (n,) numbers of the stretches that windows stay in.

    `place` counts the rows of a table, in which rows with a dropped-out channel are not: a filter in use skips such a
    row and goes on, it does not start anew. A jump in `place` is a row that belongs to another set.
    """
    if not consecutive:
        return recording
    breaks = (np.diff(recording, prepend=recording[:1]) != 0) | (np.diff(place, prepend=place[:1] - 1) != 1)
    return np.cumsum(breaks).astype(np.int64)


def part(kept: SetRows, scale: FeatureScale, k: int) -> Part:
    """Scale and filter a set, and leave the rows that have a label."""
    X = causal_mean(scale(kept.X), k, kept.segment)
    there = kept.labelled
    return Part(
        X=X[there], y=kept.y[there], time_s=kept.time_s[there], recording=kept.recording[there], row=kept.row[there],
        cluster=kept.cluster[there],
    )  # fmt: skip


def constant_features(kept: SetRows, features: Sequence[str]) -> list[str]:
    """Return the features that never change in a set."""
    spread = np.ptp(kept.X, axis=0)
    return [name for name, width in zip(features, spread, strict=True) if width == 0]
