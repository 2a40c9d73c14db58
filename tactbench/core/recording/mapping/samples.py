"""Conversion of a table's cells into samples: units are converted, and cells without a sample are marked."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError
from tactbench.core.recording.health import Finding, listed
from tactbench.core.recording.mapping.channels import MappedStream, no_translation
from tactbench.core.recording.mapping.formats import MESSAGE_TIMES
from tactbench.core.recording.mapping.model import Annotation, Bag, Mapping, TableSource, Time
from tactbench.core.recording.mapping.table import Table, nanoseconds_per
from tactbench.core.samples import FloatArray, IntArray, Quality, StreamData
from tactbench.core.spec import units
from tactbench.core.spec.recording import Scalar, composed

OUTSIDE, FAR_OUTSIDE = 3.0, 30.0
"""Distances of a channel's smallest or largest value from all others, in multiples of the range of the others, above
which it counts as no reading: for a value in short runs, and for a rare value."""
SHORT_RUN, SELDOM, OFTEN = 3.0, 0.1, 0.3
"""Longest mean run of such a value [rows], and its largest shares of the rows. Levels of a real contact last longer."""
APART = 5.0
"""Least distance of such a value within `OUTSIDE` from the sample before it, in mean steps of the other samples."""
FEWEST_VALUES = 8
"""Fewest other distinct values of a channel for which such a value is searched."""
UNSIGNED_BITS = (8, 16, 32)
"""Widths of whole numbers whose negative values may have been stored without their sign."""
MISSED = 0.05
"""Largest share of the longest table's time span that the tables may not have in common, without a report."""
FIRST, LAST = "1971-01-01", "2200-01-01"
"""Dates outside which times since 1970 count as times in a wrong unit, or of a clock that starts at zero."""


def samples(stream: MappedStream, table: Table, t_ns: IntArray | None) -> tuple[StreamData, list[Finding]]:
    """Return a recording's stream, made of a table and its clock, and findings about values that are no readings.

    Cells without a sample become NaN, or 0 in a stream of whole numbers, and are marked as missing. Raises MappingError
    if a column is missing, a cell is no number, a channel has no sample at all, or a label is not known.
    """
    stored = np.column_stack([table.numbers(channel.column) for channel in stream.channels])
    for column, channel in zip(stored.T, stream.channels, strict=True):
        column[np.isin(column, channel.group.sentinels or ())] = np.nan
    absent = np.isnan(stored)
    for place in np.flatnonzero(absent.all(axis=0)):
        channel = stream.channels[place]
        raise MappingError(
            f"{table.shown}: column {channel.column!r} (channel {channel.spec.name}) has no sample in any row.",
            hint="Leave the channel out, or correct `sentinels`.",
        )
    groups = [channel.group for channel in stream.channels]
    data = stored * [units.conversion(one.given_in or one.unit, one.unit) for one in groups]
    dtype = np.dtype(stream.spec.dtype)
    if dtype.kind != "f":
        data = np.where(absent, 0.0, data)
        limits = np.iinfo(dtype)
        for row, place in np.argwhere((data != np.rint(data)) | (data < limits.min) | (data > limits.max)):
            column = stream.channels[place].column
            raise MappingError(
                f"{table.where(row)}: column {column!r}: {data[row, place]:g} cannot be stored as {dtype}.",
                hint="Choose a wider `dtype` for the stream.",
            )
    quality = np.where(absent, Quality.MISSING, Quality.GOOD).astype(np.uint8)
    notes = {name: _labels(name, one, table) for name, one in stream.source.annotations.items()}
    return StreamData(stream.spec, t_ns, data.astype(dtype), quality, notes), list(_no_readings(stream, stored))


def times(table: Table, time: Time) -> IntArray:
    """Return the times of a table's rows, (n,) [ns].

    Raises MappingError if a cell is no time, or times since 1970 lie in an impossible year.
    """
    stamps, unit = table.nanoseconds(time), nanoseconds_per(time)
    if time.wraps_at is not None:
        period = time.wraps_at * unit
        for row in np.flatnonzero((stamps < 0) | (stamps >= period)):
            raise MappingError(
                f"{table.where(row)}: column {time.column!r} is negative, or not below {time.wraps_at}.",
                hint="Correct `wraps_at` under `time`.",
            )
        stamps = stamps + period * np.cumsum(np.diff(stamps, prepend=stamps[:1]) < -period / 2)
    dates = stamps.astype("M8[ns]")
    for row in np.flatnonzero((dates < np.datetime64(FIRST)) | (dates > np.datetime64(LAST))):
        if time.epoch == "unix":
            year = dates[row].astype("M8[Y]")
            raise MappingError(
                f"{table.where(row)}: column {time.column!r}, read in {time.unit} since 1970, gives the year {year}.",
                hint="Correct the unit, or write `epoch: start` or `epoch: unknown`.",
            )
    return stamps + round(time.offset_s * 1e9)


def _labels(name: str, annotation: Annotation, table: Table) -> npt.NDArray[Any]:
    """Return a label for every row, (n,): a text, or the number of the row's stretch; raises MappingError."""
    if annotation.column is None:
        stretches = np.arange(len(table), dtype=np.int64) // (annotation.rows_per or 1)
        if len(table) % (annotation.rows_per or 1):
            raise MappingError(
                f"{table.shown} has {len(table)} rows, no multiple of `rows_per` {annotation.rows_per} ({name}).",
                hint="Add or remove rows, or correct `rows_per`.",
            )
        return stretches
    texts = [composed(text) for text in table.texts(annotation.column)]
    if annotation.values is not None:
        known = translations(annotation.values)
        for row, text in enumerate(texts):
            if text not in known:
                raise no_translation(f"{table.where(row)}: column {annotation.column!r}:", text, name, known)
        texts = [known[text] for text in texts]
    return np.array(texts, dtype=np.str_)


def translations(values: dict[Scalar, str]) -> dict[str, str]:
    """Return a mapping file's translations of texts, with keys and values as texts in the same Unicode form."""
    return {composed(str(key)): composed(value) for key, value in values.items()}


def compare_clocks(mapping: Mapping, tables: dict[str, Table], clocks: dict[str, IntArray]) -> Iterator[Finding]:
    """Compare the clocks of joined tables; yield a finding for each difference between tables joined by clock.

    Raises MappingError if times of one row differ by more than the mapping allows, or clocks have no time in common.
    """
    if mapping.join is None or len(clocks) < 2:
        return
    if mapping.join.by == "rows":
        within_ms = mapping.join.times_within_ms or 0.0
        (first, lead), *others = clocks.items()
        for name, t_ns in others:
            apart_ms = np.abs(lead - t_ns) * 1e-6
            for row in np.flatnonzero(apart_ms > within_ms):
                raise MappingError(
                    f"{tables[name].where(row)}: its time is {apart_ms[row]:.3g} ms from that of "
                    f"{tables[first].where(row)}; the mapping allows {within_ms:g} ms.",
                    hint="The rows do not belong together, or `times_within_ms` is too strict.",
                )
        return
    kinds = {name: _kind(mapping.tables[name]) for name in clocks}
    if len({*kinds.values()}) > 1:
        stated = "; ".join(f"{name} by {kind}" for name, kind in kinds.items())
        yield Finding("mixed-stamps", "warning", f"tables are joined by stamps of different kinds: {stated}")
    spans = {name: (int(t_ns.min()), int(t_ns.max())) for name, t_ns in clocks.items()}
    late, early = max(spans, key=lambda name: spans[name][0]), min(spans, key=lambda name: spans[name][1])
    common = spans[early][1] - spans[late][0]
    if common < 0:
        dated = {name: [f"{np.datetime64(t_ns, 'ns')}" for t_ns in spans[name]] for name in (early, late)}
        shown = "; ".join(f"{tables[name].shown} (table {name!r}) {' to '.join(span)}" for name, span in dated.items())
        raise MappingError(
            f"Joined by their clocks, two tables have no time in common: {shown}; {-common * 1e-9:.6g} s lie between.",
            hint="If one clock is off by a known time, write it as `offset_s` under the `time` of its table.",
        )
    longest = max(last - first for first, last in spans.values())
    if common < (1 - MISSED) * longest:
        text = f"tables {' and '.join(spans)} have {common * 1e-9:.3g} of {longest * 1e-9:.3g} s in common"
        yield Finding("spans", "warning", text)


def _kind(source: TableSource) -> str:
    """Return a phrase about the source and epoch of a table's time stamps, for messages."""
    time = source.time
    assert time is not None
    logged = isinstance(source.read, Bag) and time.column in MESSAGE_TIMES
    return f"{time.column if logged else 'a column'} (epoch {time.epoch})"


def _no_readings(stream: MappedStream, given: FloatArray) -> Iterator[Finding]:
    """Yield a finding for each number that seems to be no reading, in the (n, channels) numbers of a table.

    Such numbers, and channels whose numbers lost their sign, are set to NaN in `given`, so that the search for further
    ones ignores them.
    """
    found: dict[str, dict[int, int]] = {}
    low, high = np.fmin.reduce(given), np.fmax.reduce(given)
    for period in (2**bits for bits in UNSIGNED_BITS):
        for place in np.flatnonzero((low >= 0) & (low < 0.1 * period) & (high > 0.9 * period) & (high < period)):
            jumps = _jumps(given[:, place], period)
            if jumps:
                given[:, place] = np.nan
                text = f"jumps between 0 and {period} in {{:g}} % of the rows, as if negative numbers lost their sign"
                found.setdefault(text, {})[int(place)] = jumps
    rows = np.isfinite(given).sum(axis=0)
    candidates = []
    for extreme in (low, high):
        at = given == extreme
        others = np.where(at, np.nan, given)
        first, last = np.fmin.reduce(others), np.fmax.reduce(others)
        off = np.minimum(np.abs(extreme - first), np.abs(extreme - last)) / np.maximum(last - first, 1e-300)
        count = at.sum(axis=0)
        places = np.flatnonzero((2 * count <= rows) & ((count > 2) | (off > OUTSIDE)))
        candidates += [(float(off[place]), int(place), float(extreme[place])) for place in places]
    for far, channel, value in sorted(candidates, reverse=True):
        if _is_apart(given[:, channel], value, far):
            text = (
                f"{value:.15g}, far from those around, in {{:g}} % of the rows; no reading? `sentinels: [{value:.15g}]`"
            )
            found.setdefault(text, {})[channel] = int((given[:, channel] == value).sum())
            given[given[:, channel] == value, channel] = np.nan
    for text, counts in found.items():
        names = tuple(stream.channels[place].spec.name for place in sorted(counts))
        percent = 100 * sum(counts.values()) / (len(names) * len(given))
        share = float(f"{percent:.1g}")  # one text for shares that differ by chance
        message = f"{listed(names)}: {text.format(share)}"
        yield Finding("no-reading", "warning", message, stream.spec.name, names)


def _jumps(column: FloatArray, period: int) -> int:
    """Return the number of jumps of a column by `period`, give or take a usual step; 0 if it has other jumps, too."""
    column = column[np.isfinite(column)]
    steps = np.abs(np.diff(column))
    jumps = 2 * steps > period
    usual = APART * max(float(steps[~jumps].mean()), 1.0) if not jumps.all() else np.inf
    like = len(np.unique(column)) > FEWEST_VALUES and jumps.sum() > 1 and usual < 0.1 * period
    return int(jumps.sum()) if like and (period - steps[jumps]).mean() < usual else 0


def _is_apart(column: FloatArray, value: float, off: float) -> bool:
    """Return True if a value is far from samples around it; `off`: distance from all others in units of their range.

    If it is near their range, the samples before and after it must be alike, unlike at a change of the contact.
    """
    column = column[np.isfinite(column)]
    at = column == value
    others, before = column[~at], np.cumsum(~at) - 1
    starts = np.flatnonzero(at & ~np.concatenate([[False], at[:-1]]))
    if len(np.unique(np.round(others / max(float(np.abs(others).max()), 1e-300), 6))) < FEWEST_VALUES:
        return False
    if off > OUTSIDE:
        short = len(starts) > 1 and at.sum() <= SHORT_RUN * len(starts) and at.mean() < OFTEN
        return short or (off > FAR_OUTSIDE and at.mean() < SELDOM)
    place = before[starts]
    place = place[(place >= 0) & (place + 1 < len(others))]
    left, right = others[place], others[place + 1]
    if len(place) < 3 or right.std() < others.std() / 3:
        return False
    apart = float(np.abs(value - left).mean())
    return apart > APART * float(np.abs(np.diff(others)).mean()) and float(np.abs(right - left).mean()) < apart / 3
