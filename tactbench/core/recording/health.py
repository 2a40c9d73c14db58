"""Is a recording healthy? What a person would look for first, looked for every time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tactbench.core.recording.reader import Recording
from tactbench.core.recording.times import recomputed_t_ns
from tactbench.core.samples import FloatArray, Quality, StreamData
from tactbench.core.spec.recording import StreamClock, StreamCounts
from tactbench.core.spec.sensor import ChannelSpec

Severity = Literal["error", "warning", "info"]

GAP = 5.0
"""A step longer than this many median steps is a gap."""
JITTER = 0.2
"""Steps whose 5th to 95th percentile spans more than this share of the median make a clock irregular."""
RATE_TOLERANCE = 0.05
"""Relative difference between the stated and the measured rate that is remarked on."""


@dataclass(frozen=True)
class Finding:
    """One thing a reader of a score from this recording should know."""

    check: str
    """Short name of the check, fit for a filter: stuck, dead, saturated, duplicated, missing, gaps …"""
    severity: Severity
    stream: str
    """Empty: the whole recording"""
    channels: tuple[str, ...]
    count: int
    """Samples, rows or channels concerned"""
    message: str


@dataclass(frozen=True)
class _Column:
    """One channel: its numbers where there are any."""

    spec: ChannelSpec
    values: FloatArray
    missing: npt.NDArray[np.bool_]
    saturated: npt.NDArray[np.bool_]
    suspect: npt.NDArray[np.bool_]

    @property
    def there(self) -> FloatArray:
        return np.asarray(self.values[~self.missing])


def examine(recording: Recording) -> list[Finding]:
    """Look at everything in an open recording, the worst first.

    Returns
    -------
    list of Finding
        Errors (an evaluation would fail or be wrong), warnings (a score may suffer), infos (a reader should know).
        Empty: nothing was found.
    """
    found = list(_whole(recording))
    clocks: dict[bytes, tuple[list[str], StreamData]] = {}
    for name in recording.stream_names:
        data = recording.read(name)
        if len(data.data) == 0:
            found.append(Finding("empty", "error", name, (), 0, f"{name} has no rows"))
            continue
        columns = list(_columns(data))
        for check in _CHECKS:
            found.extend(check(name, columns))
        found.extend(_labels(name, data))
        found.extend(_gaps(name, data))
        found.extend(_clock_fit(name, data, recording.meta.clocks.get(name)))
        if data.t_ns is not None:
            clocks.setdefault(data.t_ns.tobytes(), ([], data))[0].append(name)
    for names, data in clocks.values():
        found.extend(_clock(" and ".join(names), data))
    order = {"error": 0, "warning": 1, "info": 2}
    return sorted(found, key=lambda finding: order[finding.severity])


def _whole(recording: Recording) -> Iterator[Finding]:
    meta = recording.meta
    if meta.excluded:
        yield Finding("excluded", "warning", "", (), 1, f"excluded from every evaluation: {meta.excluded}")
    if meta.clock == "none":
        yield Finding("no-clock", "info", "", (), 0, "no clock stated: rows are ordered, nothing more")
    if meta.clock == "nominal":
        yield Finding("no-clock", "info", "", (), 0, "time stamps are row number by nominal rate, not measured")
    for name, counts in meta.streams.items():
        yield from _counts(name, counts)
    absent = [spec.name for spec in (*meta.sensor.streams, *meta.reference) if spec.name not in recording.stream_names]
    if absent:
        yield Finding("absent", "warning", "", (), len(absent), f"declared but not recorded: {', '.join(absent)}")


def _counts(stream: str, counts: StreamCounts) -> Iterator[Finding]:
    lost = [f"{counts.gaps} never came"] if counts.gaps else []
    lost += [f"{counts.dropped} were dropped because writing was behind"] if counts.dropped else []
    if lost:
        text = f"{stream} lost rows: {', '.join(lost)}"
        yield Finding("lost", "warning", stream, (), counts.gaps + counts.dropped, text)
    again = counts.duplicates + counts.late
    if again:
        text = f"{stream}: {again} rows came twice or late, and were kept out"
        yield Finding("repeated", "info", stream, (), again, text)
    open_rows = counts.received - counts.written - counts.dropped - again
    if open_rows:
        text = f"{stream}: {abs(open_rows)} rows {'more' if open_rows > 0 else 'fewer'} received than accounted for"
        yield Finding("unaccounted", "warning", stream, (), abs(open_rows), text)


def _gaps(stream: str, data: StreamData) -> Iterator[Finding]:
    count = 0 if data.quality is None else int(((data.quality & Quality.GAP) != 0).any(axis=1).sum())
    if count:
        text = f"{stream}: rows were lost before {count} of {len(data.data)} rows"
        yield Finding("rows-before-lost", "warning", stream, (), count, text)


def _clock_fit(stream: str, data: StreamData, clock: StreamClock | None) -> Iterator[Finding]:
    if clock is None or data.host_ns is None:
        return
    other = int(np.count_nonzero(recomputed_t_ns(data, clock) != data.t_ns))
    if other:
        text = f"{other} times of {stream} are not those of its device's clock and the stated lines"
        yield Finding("clock-fit", "error", stream, (), other, text)
    if any(segment.bound_ns is None for segment in clock.segments):
        text = f"{stream}: too few rows to say how well its clock was put on the host's"
        yield Finding("clock-bound", "info", stream, (), 0, text)
    if clock.breaks:
        text = f"the clock of {stream} began again (times: {clock.breaks})"
        yield Finding("clock-lost", "warning", stream, (), clock.breaks, text)


def _columns(data: StreamData) -> Iterator[_Column]:
    numbers = data.data.astype(np.float64)
    quality = np.zeros(numbers.shape, dtype=np.uint8) if data.quality is None else data.quality
    for place, spec in enumerate(data.spec.channels):
        values, flags = numbers[:, place], quality[:, place]
        missing = ~np.isfinite(values) | ((flags & Quality.MISSING) != 0)
        saturated = (flags & Quality.SATURATED) != 0
        # A temperature of a room or a position at a stop may equal a stated limit; a converter's end is what counts.
        if spec.unit == "count" or spec.kind in ("force", "torque"):
            if spec.upper is not None:
                saturated |= values >= spec.upper
            if spec.lower is not None and (spec.lower != 0 or spec.unit == "count"):
                saturated |= values <= spec.lower
        yield _Column(spec, values, missing, saturated & ~missing, (flags & Quality.SUSPECT) != 0)


def _dead(stream: str, columns: Sequence[_Column]) -> Iterator[Finding]:
    dead = [one for one in columns if one.missing.all()]
    if dead:
        names = _names(dead)
        yield Finding("dead", "error", stream, _of(dead), len(dead), f"{names} without a single sample")


def _stuck(stream: str, columns: Sequence[_Column]) -> Iterator[Finding]:
    stuck = [one for one in columns if len(one.there) > 1 and np.ptp(one.there) == 0]
    if stuck:
        yield Finding("stuck", "warning", stream, _of(stuck), len(stuck), f"{_names(stuck)} constant")


def _saturated(stream: str, columns: Sequence[_Column]) -> Iterator[Finding]:
    for one in columns:
        count = int(one.saturated.sum())
        if count:
            text = f"{one.spec.name} saturated in {count} of {len(one.values)} samples"
            yield Finding("saturated", "warning", stream, (one.spec.name,), count, text)


def _missing(stream: str, columns: Sequence[_Column]) -> Iterator[Finding]:
    alike: dict[int, list[_Column]] = {}
    for one in columns:
        if one.missing.any() and not one.missing.all():
            alike.setdefault(int(one.missing.sum()), []).append(one)
    for count, some in alike.items():
        text = f"{_names(some)} without a sample in {count} of {len(some[0].values)} rows"
        yield Finding("missing", "info", stream, _of(some), count, text)


def _suspect(stream: str, columns: Sequence[_Column]) -> Iterator[Finding]:
    some = [one for one in columns if one.suspect.any()]
    if some:
        count = sum(int(one.suspect.sum()) for one in some)
        text = f"{_names(some)}: {count} samples failed parity, checksum or sequence"
        yield Finding("suspect", "warning", stream, _of(some), count, text)


def _duplicated(stream: str, columns: Sequence[_Column]) -> Iterator[Finding]:
    """Two channels that always read the same are one channel wired or parsed twice."""
    twins: dict[bytes, list[_Column]] = {}
    for one in columns:
        # Constant channels may agree by accident, and are reported already; adding 0 makes -0 and 0 one.
        if len(one.there) > 1 and np.ptp(one.there) > 0:
            twins.setdefault((one.values + 0.0).tobytes(), []).append(one)
    for some in twins.values():
        if len(some) > 1:
            yield Finding("duplicated", "warning", stream, _of(some), len(some), f"{_names(some)} identical")


_CHECKS: tuple[Callable[[str, Sequence[_Column]], Iterator[Finding]], ...] = (
    _dead, _stuck, _saturated, _missing, _suspect, _duplicated,
)  # fmt: skip


def _clock(stream: str, data: StreamData) -> Iterator[Finding]:
    if data.t_ns is None or len(data.t_ns) < 2:
        return
    steps = np.diff(data.t_ns)
    backward, doubled = int((steps < 0).sum()), int((steps == 0).sum())
    if backward:
        row = int(np.flatnonzero(steps < 0)[0]) + 1
        text = f"time runs backwards {backward} times in {stream}, first at row {row}"
        yield Finding("backward", "error", stream, (), backward, text)
    if doubled:
        text = f"{doubled} of {len(data.t_ns)} time stamps of {stream} equal the one before"
        yield Finding("repeated-time", "warning", stream, (), doubled, text)
    forward = steps[steps > 0] * 1e-9
    if len(forward) < 3:
        return
    median = float(np.median(forward))
    gaps = forward[forward > GAP * median]
    if len(gaps):
        text = f"{len(gaps)} gaps in {stream}: up to {gaps.max():.3g} s, where the median step is {median:.3g} s"
        yield Finding("gaps", "warning", stream, (), len(gaps), text)
    low, high = np.percentile(forward, (5, 95))
    rate = (len(data.t_ns) - 1) / (float(data.t_ns[-1] - data.t_ns[0]) * 1e-9) if not backward else 1 / median
    if high - low > JITTER * median:
        text = (
            f"irregular clock in {stream}: median step {median:.3g} s, 5th to 95th percentile {low:.3g} to "
            f"{high:.3g} s, mean rate {rate:.3g} Hz"
        )
        yield Finding("irregular", "info", stream, (), 0, text)
    stated = data.spec.rate_hz
    if stated is not None and abs(rate - stated) > RATE_TOLERANCE * stated:
        yield Finding("rate", "warning", stream, (), 0, f"{stream} runs at {rate:.4g} Hz; {stated:g} Hz are stated")


def _labels(stream: str, data: StreamData) -> Iterator[Finding]:
    for name, column in data.annotations.items():
        values = np.unique(column)
        if len(values) == 1 and len(column) > 1:
            text = f"label {name} is {_shown(values[0])!r} in every row"
            yield Finding("constant-label", "info", stream, (), len(column), text)


def _shown(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _of(columns: Sequence[_Column]) -> tuple[str, ...]:
    return tuple(one.spec.name for one in columns)


def _names(columns: Sequence[_Column]) -> str:
    """Name channels as people would: "taxels t4 and t7", "fz", "E1, E2, E3 … (19 channels)"."""
    names = _of(columns)
    if len(names) > 6:
        return f"{', '.join(names[:3])} … ({len(names)} channels)"
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    if all(one.spec.kind == "taxel" for one in columns):
        return f"taxel{'s' if len(names) > 1 else ''} {listed}"
    return listed
