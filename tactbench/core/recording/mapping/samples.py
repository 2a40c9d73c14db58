"""From cells to samples: units converted, what is no sample marked as such and counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.channels import MappedChannel, MappedStream
from tactbench.core.recording.mapping.model import MUST_NAME_SENTINELS, Annotation, Mapping, Time
from tactbench.core.recording.mapping.table import Table, nanoseconds_per
from tactbench.core.samples import FloatArray, IntArray, Quality
from tactbench.core.spec import units
from tactbench.core.spec.recording import composed

REPEATED_SHARE = 0.05
"""A single value outside the range of all others in more than this share of the rows is taken for a sentinel."""
YEARS = (1970, 2200)
"""Times since 1970 outside these years are taken for a wrong unit or epoch."""
_NS_PER_YEAR = 365.2425 * 86400 * 1e9


@dataclass(frozen=True)
class Samples:
    """A stream of one recording, ready to be written."""

    data: npt.NDArray[Any]
    """(n, channels); NaN, or 0 where the stream stores whole numbers, where there is no sample"""
    quality: npt.NDArray[np.uint8]
    missing: dict[str, int] = field(default_factory=dict)
    """Samples marked as missing, by channel"""


def samples(stream: MappedStream, table: Table) -> Samples:
    """Read a stream's channels from `table`.

    Raises
    ------
    MappingError
        If a column is missing, a cell is no number, a channel has no sample at all, or a column seems to hold a
        sentinel that nobody named.
    """
    data = np.empty((len(table), len(stream.channels)))
    missing = {}
    for place, channel in enumerate(stream.channels):
        given = table.numbers(channel.column)
        absent = np.isnan(given) | np.isin(given, channel.group.sentinels or ())
        _some_sample(channel, table, absent)
        _no_hidden_sentinel(channel, table, given[~absent])
        factor = units.conversion(channel.group.given_in or channel.group.unit, channel.group.unit)
        data[:, place] = np.where(absent, np.nan, given * factor)
        if absent.any():
            missing[channel.spec.name] = int(absent.sum())
    absent = np.isnan(data)
    quality = np.where(absent, Quality.MISSING, Quality.GOOD).astype(np.uint8)
    column_dtype = np.dtype(stream.spec.dtype)
    if column_dtype.kind != "f":
        data = np.where(absent, 0.0, data)
        _fits(stream, table, data, column_dtype)
    return Samples(data.astype(column_dtype), quality, missing)


def times(table: Table, time: Time) -> IntArray:
    """Return the clock of a table, (n,) nanoseconds.

    Raises
    ------
    MappingError
        If a cell is no time, or times since 1970 lie in an impossible year.
    """
    stamps = table.nanoseconds(time)
    unit = nanoseconds_per(time)
    if time.wraps_at is not None:
        stamps = _unwrapped(table, stamps, time, time.wraps_at * unit)
    elif period := wrap_period(stamps, (unit,)):
        row = int(np.flatnonzero(np.diff(stamps) < 0)[0]) + 1
        raise MappingError(
            f"{table.where(row)}: column {time.column!r} begins at 0 again after nearly {period // unit}, as a full "
            "counter does.",
            hint=f"Write `wraps_at: {period // unit}` under `time`.",
        )
    if time.epoch == "unix":
        years = 1970 + stamps / _NS_PER_YEAR
        # Anything below a year after 1970 is a clock that starts at zero, not one of that epoch.
        wrong = np.flatnonzero((years < YEARS[0] + 1) | (years > YEARS[1]))
        if len(wrong):
            row = int(wrong[0])
            raise MappingError(
                f"{table.where(row)}: column {time.column!r} in {time.unit} since 1970 would be the year "
                f"{years[row]:.0f}.",
                hint="Correct the unit, or write `epoch: start` or `epoch: unknown`.",
            )
    return stamps


def wrap_period(t_ns: IntArray, units_ns: Sequence[int] = (1, 10**3, 10**6, 10**9)) -> int:
    """Return after how many nanoseconds a clock that runs backwards begins at 0 again, if it is such a counter, or 0.

    It is one of 16, 24 or 32 bits of one of the units if every step backwards leads from within twenty median steps, or
    a sixteenth of its range, below its end to within as many above 0.
    """
    steps = np.diff(t_ns)
    back = np.flatnonzero(steps < 0)
    if not len(back) or not (steps > 0).any():
        return 0
    before, after, near = t_ns[back], t_ns[back + 1], 20 * float(np.median(steps[steps > 0]))
    for period in (unit * 2**bits for unit in units_ns for bits in (16, 24, 32)):
        least = max(period - near, period * 15 / 16)
        if ((least <= before) & (before < period) & (after >= 0) & (after <= period - least)).all():
            return int(period)
    return 0


def _unwrapped(table: Table, stamps: IntArray, time: Time, period: int) -> IntArray:
    outside = np.flatnonzero((stamps < 0) | (stamps >= period))
    if len(outside):
        raise MappingError(
            f"{table.where(int(outside[0]))}: column {time.column!r} is not below {time.wraps_at}.",
            hint="Correct `wraps_at` under `time`.",
        )
    wraps = np.cumsum(np.diff(stamps, prepend=stamps[:1]) < -period / 2)
    return stamps + wraps * period


def labels(name: str, annotation: Annotation, table: Table) -> npt.NDArray[Any]:
    """Return a label for every row, (n,): texts, or numbers of equal stretches.

    Raises
    ------
    MappingError
        If a value has no translation, or the rows do not come out even.
    """
    if annotation.rows_per is not None:
        if len(table) % annotation.rows_per:
            raise MappingError(
                f"{table.shown} has {len(table)} rows: not a whole number of {annotation.rows_per} ({name}).",
                hint="Rows are missing or too many, or `rows_per` is wrong.",
            )
        return np.arange(len(table), dtype=np.int64) // annotation.rows_per
    assert annotation.column is not None  # the model says: either rows_per or a column
    texts = [composed(text) for text in table.texts(annotation.column)]
    if annotation.values is not None:
        known = {composed(str(key)): composed(value) for key, value in annotation.values.items()}
        for row, text in enumerate(texts):
            if text not in known:
                raise MappingError(
                    f"{table.where(row)}: column {annotation.column!r}: {text!r} has no translation for {name!r}; "
                    f"there are: {', '.join(known)}.",
                    hint="Add it to `values`; translate what means 'no label' to an empty text.",
                )
        texts = [known[text] for text in texts]
    return np.array(texts, dtype=np.str_)


def check_join(mapping: Mapping, tables: dict[str, Table]) -> None:
    """Compare tables joined by rows: equally long, and their times as close as the mapping promises.

    Raises
    ------
    MappingError
        If they differ; the message names the first row that does.
    """
    if mapping.join is None or mapping.join.by != "rows":
        return
    (first, lead), *others = tables.items()
    for name, table in others:
        if len(table) != len(lead):
            raise MappingError(
                f"{table.shown} (table {name!r}) has {len(table)} rows, {lead.shown} has {len(lead)}.",
                hint="Tables joined by rows must be equally long; with a clock each, `by: clock` is an alternative.",
            )
        own, other = mapping.tables[first].time, mapping.tables[name].time
        within = mapping.join.times_within_ms
        if own is None or other is None or within is None:
            continue
        apart_ms = np.abs(times(lead, own) - times(table, other)) * 1e-6
        if (apart_ms > within).any():
            row = int(np.flatnonzero(apart_ms > within)[0])
            raise MappingError(
                f"{table.where(row)}: its time is {apart_ms[row]:.3g} ms from that of {lead.where(row)}; the mapping "
                f"allows {within:g} ms.",
                hint="The rows do not belong together, or `times_within_ms` is too strict.",
            )


def _some_sample(channel: MappedChannel, table: Table, absent: npt.NDArray[np.bool_]) -> None:
    if absent.all():
        raise MappingError(
            f"{table.shown}: column {channel.column!r} (channel {channel.spec.name}) has no sample in any of "
            f"{len(absent)} rows.",
            hint="Leave the channel out, or correct `sentinels`.",
        )


def _no_hidden_sentinel(channel: MappedChannel, table: Table, given: FloatArray) -> None:
    """Refuse a target column in which one number, apart from all others, keeps coming back."""
    if channel.group.kind not in MUST_NAME_SENTINELS or channel.group.keep_repeated:
        return
    for value in (given.min(), given.max()):
        count = int((given == value).sum())
        share = count / len(given)
        if count > 1 and REPEATED_SHARE < share < 1:
            raise MappingError(
                f"{table.shown}: column {channel.column!r} (channel {channel.spec.name}) is {value:g} in "
                f"{100 * share:.1f} % of the rows and on one side of it in all others: that looks like 'no sample'.",
                hint=f"Write `sentinels: [{value:g}]`, or `keep_repeated: true` if it is a real reading.",
            )


def _fits(stream: MappedStream, table: Table, data: FloatArray, column_dtype: np.dtype[Any]) -> None:
    limits = np.iinfo(column_dtype)
    wrong = (data != np.rint(data)) | (data < limits.min) | (data > limits.max)
    if wrong.any():
        row, place = (int(index) for index in np.argwhere(wrong)[0])
        raise MappingError(
            f"{table.where(row)}: column {stream.channels[place].column!r}: {data[row, place]:g} is no {column_dtype}.",
            hint="Choose a wider `dtype` for the stream.",
        )
