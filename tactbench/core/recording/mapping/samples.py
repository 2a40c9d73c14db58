"""Conversion of cells into samples: units are converted, and cells without a sample are marked and counted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError
from tactbench.core.recording.health import Finding, listed
from tactbench.core.recording.mapping.bags import MESSAGE_TIMES
from tactbench.core.recording.mapping.channels import MappedChannel, MappedStream, no_translation
from tactbench.core.recording.mapping.model import Annotation, Bag, Mapping, Time
from tactbench.core.recording.mapping.table import Table, nanoseconds_per
from tactbench.core.samples import FloatArray, IntArray, Quality
from tactbench.core.spec import units
from tactbench.core.spec.recording import composed

OUTSIDE, FAR_OUTSIDE = 3.0, 30.0
"""How far the smallest or largest value of a channel lies from all others, in ranges of these, if it is taken for no
reading: where it comes in short runs, and where it comes once or seldom."""
SHORT_RUN, SELDOM, OFTEN = 3.0, 0.1, 0.3
"""Longest mean run [rows], and largest shares of the rows. A contact has levels too, but stays on them."""
APART = 5.0
"""How far such a value lies from the sample before it, in mean steps of the others, where it lies within `OUTSIDE`."""
FEWEST_VALUES = 8
"""Fewest other values that a channel must have to be judged."""
UNSIGNED_BITS = (8, 16, 32)
"""Widths of whole numbers whose negative values may have been stored without their sign."""
MISSED = 0.05
"""Share of the longest span that tables may lack in common before their spans are reported to differ."""
YEARS = (1970, 2200)
"""Times since 1970 are taken for times in a wrong unit or epoch if they lie outside these years."""
_NS_PER_YEAR = 365.2425 * 86400 * 1e9


@dataclass(frozen=True)
class Samples:
    """The samples of a stream of one recording, ready to be written."""

    data: npt.NDArray[Any]
    """(n, channels); where there is no sample, NaN, or 0 in a stream of whole numbers."""
    quality: npt.NDArray[np.uint8]
    """(n, channels) of :class:`~tactbench.core.samples.Quality`."""
    missing: dict[str, int] = field(default_factory=dict)
    """Samples marked as missing, by channel."""
    findings: tuple[Finding, ...] = ()
    """Reports of values that seem to be no readings."""


def samples(stream: MappedStream, table: Table) -> Samples:
    """Return the samples of a stream's channels, read from `table`.

    Raises
    ------
    MappingError
        If a column is missing, a cell is no number, or a channel has no sample at all.
    """
    data, stored = np.empty((2, len(table), len(stream.channels)))
    missing = {}
    for place, channel in enumerate(stream.channels):
        given = table.numbers(channel.column)
        absent = np.isnan(given) | np.isin(given, channel.group.sentinels or ())
        _some_sample(channel, table, absent)
        factor = units.conversion(channel.group.given_in or channel.group.unit, channel.group.unit)
        stored[:, place] = np.where(absent, np.nan, given)
        data[:, place] = stored[:, place] * factor
        if absent.any():
            missing[channel.spec.name] = int(absent.sum())
    absent = np.isnan(data)
    quality = np.where(absent, Quality.MISSING, Quality.GOOD).astype(np.uint8)
    column_dtype = np.dtype(stream.spec.dtype)
    if column_dtype.kind != "f":
        data = np.where(absent, 0.0, data)
        _fits(stream, table, data, column_dtype)
    return Samples(data.astype(column_dtype), quality, missing, tuple(_no_readings(stream, stored)))


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
    return stamps + round(time.offset_s * 1e9)


def wrap_period(t_ns: IntArray, units_ns: Sequence[int] = (1, 10**3, 10**6, 10**9)) -> int:
    """Return the period [ns] of a clock that runs backwards because its counter begins at 0 again; 0 for another clock.

    The counter has 16, 24 or 32 bits of one of the units if every step backwards leads from within twenty median steps,
    or a sixteenth of its range, below its end to within as many above 0.
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
    """Return a label for every row, (n,): a text, or the number of its stretch.

    Raises
    ------
    MappingError
        If a value has no translation, or the rows do not come out even.
    """
    if annotation.rows_per is not None:
        if len(table) % annotation.rows_per:
            raise MappingError(
                f"{table.shown} has {len(table)} rows, which are no whole stretches of {annotation.rows_per} ({name}).",
                hint="Add or remove rows, or correct `rows_per`.",
            )
        return np.arange(len(table), dtype=np.int64) // annotation.rows_per
    assert annotation.column is not None  # the model says: either rows_per or a column
    texts = [composed(text) for text in table.texts(annotation.column)]
    if annotation.values is not None:
        known = {composed(str(key)): composed(value) for key, value in annotation.values.items()}
        for row, text in enumerate(texts):
            if text not in known:
                raise no_translation(f"{table.where(row)}: column {annotation.column!r}:", text, name, known)
        texts = [known[text] for text in texts]
    return np.array(texts, dtype=np.str_)


def compare_clocks(mapping: Mapping, tables: dict[str, Table], clocks: dict[str, IntArray]) -> Iterator[Finding]:
    """Compare the clocks of joined tables, and yield in what those of tables that are joined by them differ.

    Raises
    ------
    MappingError
        If times of one row differ by more than the mapping allows, or clocks have no time in common.
    """
    if mapping.join is None or len(clocks) < 2:
        return
    if mapping.join.by == "rows":
        _compare_rows(tables, clocks, mapping.join.times_within_ms or 0.0)
        return
    kinds: dict[str, list[str]] = {}
    for name in clocks:
        source = mapping.tables[name]
        time = source.time
        assert time is not None  # it has a clock
        logged = isinstance(source.read, Bag) and time.column in MESSAGE_TIMES
        kinds.setdefault(f"{time.column if logged else 'a column'} (epoch {time.epoch})", []).append(name)
    if len(kinds) > 1:
        stated = "; ".join(f"{' and '.join(names)} by {kind}" for kind, names in kinds.items())
        text = f"tables are joined by stamps of different kinds: {stated}"
        yield Finding("mixed-stamps", "warning", text, count=len(kinds))
    spans = {name: (int(t_ns.min()), int(t_ns.max())) for name, t_ns in clocks.items()}
    late, early = max(spans, key=lambda name: spans[name][0]), min(spans, key=lambda name: spans[name][1])
    common = spans[early][1] - spans[late][0]
    if common < 0:
        shown = "; ".join(
            f"{tables[name].shown} (table {name!r}) from {_moment(mapping, name, spans[name][0])} to "
            f"{_moment(mapping, name, spans[name][1])}"
            for name in (early, late)
        )
        raise MappingError(
            f"Joined by their clocks, two tables have no time in common: {shown}; {-common * 1e-9:.6g} s lie between.",
            hint="If one clock is off by a known time, write it as `offset_s` under the `time` of its table.",
        )
    longest = max(last - first for first, last in spans.values())
    if common < (1 - MISSED) * longest:
        begun, ended = (max(ends) - min(ends) for ends in zip(*spans.values(), strict=True))
        text = (
            f"tables {' and '.join(spans)} have {common * 1e-9:.3g} of {longest * 1e-9:.3g} s in common: they begin "
            f"{begun * 1e-9:.3g} s and end {ended * 1e-9:.3g} s apart"
        )
        yield Finding("spans", "warning", text)


def _compare_rows(tables: dict[str, Table], clocks: dict[str, IntArray], within_ms: float) -> None:
    (first, lead), *others = clocks.items()
    for name, t_ns in others:
        apart_ms = np.abs(lead - t_ns) * 1e-6
        if (apart_ms > within_ms).any():
            row = int(np.flatnonzero(apart_ms > within_ms)[0])
            raise MappingError(
                f"{tables[name].where(row)}: its time is {apart_ms[row]:.3g} ms from that of "
                f"{tables[first].where(row)}; the mapping allows {within_ms:g} ms.",
                hint="The rows do not belong together, or `times_within_ms` is too strict.",
            )


def _moment(mapping: Mapping, name: str, t_ns: int) -> str:
    time = mapping.tables[name].time
    if time is not None and time.epoch == "unix":
        return f"{np.datetime64(t_ns, 'ns').astype('datetime64[ms]')}Z"
    return f"{t_ns * 1e-9:.3f} s"


def _some_sample(channel: MappedChannel, table: Table, absent: npt.NDArray[np.bool_]) -> None:
    if absent.all():
        raise MappingError(
            f"{table.shown}: column {channel.column!r} (channel {channel.spec.name}) has no sample in any of "
            f"{len(absent)} rows.",
            hint="Leave the channel out, or correct `sentinels`.",
        )


def _no_readings(stream: MappedStream, given: FloatArray) -> Iterator[Finding]:
    """Yield a finding for each number that seems to be no reading, in the (n, channels) numbers of a table.

    Such numbers become NaN in `given`, so that the search for others goes on without them.
    """
    found: dict[str, dict[int, int]] = {}
    low, high = np.fmin.reduce(given), np.fmax.reduce(given)
    sound = np.ones(given.shape[1], dtype=bool)
    for period in (2**bits for bits in UNSIGNED_BITS):
        for place in np.flatnonzero((low >= 0) & (low < 0.1 * period) & (high > 0.9 * period) & (high < period)):
            jumps = _jumps(given[:, place], period)
            if jumps:
                sound[place] = False
                text = f"jumps between 0 and {period} in {{:g}} % of the rows, as numbers below 0 without a sign do"
                found.setdefault(text, {})[int(place)] = jumps
    rows = np.isfinite(given).sum(axis=0)
    candidates = []
    for extreme in (low, high):
        at = given == extreme
        others = np.where(at, np.nan, given)
        first, last = np.fmin.reduce(others), np.fmax.reduce(others)
        off = np.minimum(np.abs(extreme - first), np.abs(extreme - last)) / np.maximum(last - first, 1e-300)
        count = at.sum(axis=0)
        places = np.flatnonzero(sound & (2 * count <= rows) & ((count > 2) | (off > OUTSIDE)))
        candidates += [(float(off[place]), int(place), float(extreme[place])) for place in places]
    for far, channel, value in sorted(candidates, reverse=True):
        if _is_apart(given[:, channel], value, far):
            text = (
                f"{value:.15g}, far from those around, in {{:g}} % of the rows; no reading? `sentinels: [{value:.15g}]`"
            )
            found.setdefault(text, {})[channel] = int((given[:, channel] == value).sum())
            given[given[:, channel] == value, channel] = np.nan
    for text, counts in found.items():
        names, count = tuple(stream.channels[place].spec.name for place in sorted(counts)), sum(counts.values())
        share = float(f"{100 * count / (len(names) * len(given)):.1g}")  # one text for shares that differ by chance
        message = f"{listed(names)}: {text.format(share)}"
        yield Finding("no-reading", "warning", message, stream.spec.name, names, count)


def _jumps(column: FloatArray, period: int) -> int:
    """Return how often a column jumps by a period, give or take a usual step; 0 if it jumps in another way too."""
    column = column[np.isfinite(column)]
    steps = np.abs(np.diff(column))
    jumps = 2 * steps > period
    usual = APART * max(float(steps[~jumps].mean()), 1.0) if not jumps.all() else np.inf
    like = len(np.unique(column)) > FEWEST_VALUES and jumps.sum() > 1 and usual < 0.1 * period
    return int(jumps.sum()) if like and (period - steps[jumps]).mean() < usual else 0


def _is_apart(column: FloatArray, value: float, off: float) -> bool:
    """Return whether a value lies apart from the samples around it; `off` is its distance in ranges of all others.

    Near their range, the samples before and after it must be alike: a contact at rest changes its level only once.
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


def _fits(stream: MappedStream, table: Table, data: FloatArray, column_dtype: np.dtype[Any]) -> None:
    limits = np.iinfo(column_dtype)
    wrong = (data != np.rint(data)) | (data < limits.min) | (data > limits.max)
    if wrong.any():
        row, place = (int(index) for index in np.argwhere(wrong)[0])
        raise MappingError(
            f"{table.where(row)}: column {stream.channels[place].column!r}: {data[row, place]:g} is no {column_dtype}.",
            hint="Choose a wider `dtype` for the stream.",
        )
