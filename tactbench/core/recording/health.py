"""Checks of a recording for faults: gaps, missing samples, constant or identical channels, lagging clocks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from tactbench.core.recording import format as layout
from tactbench.core.recording.clock_fit import wrong_rate
from tactbench.core.recording.format import Array
from tactbench.core.recording.lag import FEWEST_ROWS, find_lag, windows
from tactbench.core.recording.reader import LazyStream, Recording
from tactbench.core.samples import FloatArray, IntArray, Quality, StreamData
from tactbench.core.spec.recording import StreamClock, StreamCounts
from tactbench.core.spec.sensor import ChannelSpec

Severity = Literal["error", "warning", "info"]

GAP = 5.0
"""Length of a time step, in median steps, above which the step is a gap."""
MOST_LISTED = 6
"""Largest number of channels that a message names one by one."""
RATE_TOLERANCE = 0.05
"""Relative difference between stated and measured rate above which the difference is reported."""
COPY = 1.0 - 1e-8
"""Correlation above which two columns are copies: rounding leaves 1 - 1e-9, noise 80 dB below the signal 1 - 1e-8."""
LAG = 5
"""Largest number of rows by which a copy may be early or late, because of a shift or a filter's delay; rows without a
sample are not counted."""
FEWEST_VALUES = 200
"""Fewest distinct values whose equal order is no chance: noise of a thousandth of the range swaps some twenty pairs
among 200 values (0.56 n² noise / range among n)."""
MONOTONE = f"apart from rounding a monotone function of {{}}, at most {LAG} rows early or late"
"""Phrase in messages about a channel that copies the channel named in the braces."""
GLANCE = 50
"""Number of rows compared first, to reject most pairs of columns before all rows are compared."""
WRONG_UNIT = 50.0
"""Factor between the stated and the measured rate of a stream above which its times are probably in a wrong unit."""
FINDINGS = "findings"
"""Key in a recording's provenance under which an import stores its findings."""
UNMARKED = ("stuck", "duplicated", "saturated", "dead", "empty", "absent", "excluded", "target-among-features")
"""Checks whose findings are not shown with scores. Untouched taxels are constant and identical, pressed ones saturate;
from `dead` on, an evaluation that needs the missing data refuses the recording or reports the fault."""
DATED_NS = 10**18
"""Time [ns since 1970: September 2001] from which times count as dates; a wrong unit would give another millennium."""
SLOWEST_HZ = 1.0
"""Lowest rate of a tactile sensor: if no rate is stated, a lower measured rate suggests times in a wrong unit."""


@dataclass(frozen=True)
class Finding:
    """A fault or fact found in a recording that may affect scores computed from the recording."""

    check: str
    """Short name of the check, for filters: stuck, dead, saturated, duplicated, missing, gaps …"""
    severity: Severity
    message: str
    stream: str = ""
    """Name of the stream; empty for a finding about the whole recording."""
    channels: tuple[str, ...] = ()


class _Stream:
    """Statistics of a stream that the checks need, gathered in one pass; arrays are (channels,)."""

    def __init__(self, stream: LazyStream) -> None:
        self.name, self.spec, self.rows = stream.spec.name, stream.spec, len(stream)
        channels = self.spec.channels
        self.t_ns = stream.times()
        self._stream = stream
        self.missing, self.saturated, self.suspect = (np.zeros(len(channels), dtype=np.int64) for _ in range(3))
        self.low, self.high = np.full(len(channels), np.inf), np.full(len(channels), -np.inf)
        self.lost_before = 0
        digests = [hashlib.sha256() for _ in channels]
        bottom, top = np.array([_ends(one) for one in channels]).T
        for block in stream.blocks():
            values, flags, missing = _numbers(block)
            saturated = ((flags & Quality.SATURATED) != 0) | (values >= top) | (values <= bottom)
            self.missing += missing.sum(axis=0)
            self.saturated += (saturated & ~missing).sum(axis=0)
            self.suspect += ((flags & Quality.SUSPECT) != 0).sum(axis=0)
            self.lost_before += int(((flags & Quality.GAP) != 0).any(axis=1).sum())
            self.low = np.minimum(self.low, values.min(axis=0, initial=np.inf, where=~missing))
            self.high = np.maximum(self.high, values.max(axis=0, initial=-np.inf, where=~missing))
            for digest, column in zip(digests, np.ascontiguousarray(values.T), strict=True):
                digest.update(column.data)
        self.contents = [digest.digest() for digest in digests]

    def names(self, which: Array) -> tuple[str, ...]:
        """Return the names of the channels for which the mask `which`, (channels,), is True."""
        return tuple(one.name for one, taken in zip(self.spec.channels, which, strict=True) if taken)

    def between(self, kind: str, first_ns: int, last_ns: int) -> tuple[IntArray, FloatArray]:
        """Return times (n,) [ns] and samples (n, q) of a kind of channels, from the rows in which all have a sample."""
        assert self.t_ns is not None  # only streams with times are compared
        rows = slice(*np.searchsorted(self.t_ns, (first_ns, last_ns + 1)))
        values, _, missing = _numbers(self._stream[rows])
        wanted = [one.kind == kind for one in self.spec.channels] & (2 * self.missing < self.rows)
        there = ~missing[:, wanted].any(axis=1)
        return self.t_ns[rows][there], values[there][:, wanted]


def listed(names: Sequence[str], kind: str = "channels", most: int = MOST_LISTED) -> str:
    """Return names as a phrase: "t4 and t7"; of more than `most` names only some: "E1, E2, E3 … (19 channels)"."""
    if len(names) > most:
        return f"{', '.join(names[: most // 2])} … ({len(names)} {kind})"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _numbers(block: StreamData) -> tuple[FloatArray, npt.NDArray[np.uint8], npt.NDArray[np.bool_]]:
    """Return the samples of a block, their quality flags, and the mask of missing samples, (n, channels) each."""
    values = block.data.astype(np.float64) + 0.0  # -0 and 0 are one
    flags = np.zeros(values.shape, dtype=np.uint8) if block.quality is None else block.quality
    return values, flags, ~np.isfinite(values) | ((flags & Quality.MISSING) != 0)


def _ends(spec: ChannelSpec) -> tuple[float, float]:
    """Return the lower and the upper reading at which a channel is saturated; infinite: no saturation.

    A temperature or position may equal its stated limit without saturation; limits of raw counts and forces are used.
    """
    low, high = spec.lower, spec.upper
    if spec.unit != "count":
        low = None if low == 0 else low
        low, high = (low, high) if spec.kind in ("force", "torque") else (None, None)
    return -np.inf if low is None else low, np.inf if high is None else high


def examine(recording: Recording) -> list[Finding]:
    """Check an open recording and return all findings, the most severe first.

    Errors: an evaluation would fail or be wrong; warnings: a score may be worse; infos: facts for the reader.
    """
    found = list(_meta_findings(recording))
    clocks: dict[bytes, tuple[list[str], _Stream]] = {}
    streams: dict[str, _Stream] = {}
    for name in recording.stream_names:
        stream = _Stream(recording.stream(name))
        if stream.rows == 0:
            found.append(Finding("empty", "error", f"{name} has no rows", name))
            continue
        found.extend(_channels(stream))
        if stream.lost_before:
            text = f"{name}: {stream.lost_before} of {stream.rows} rows follow lost rows"
            found.append(Finding("rows-before-lost", "warning", text, name))
        if name in recording.meta.clocks:
            found.extend(_clock_fit(name, recording.meta.clocks[name], stream))
        if stream.t_ns is not None:
            streams[name] = stream
            clocks.setdefault(hashlib.sha256(stream.t_ns.data).digest(), ([], stream))[0].append(name)
    for names, stream in clocks.values():
        found.extend(_clock(" and ".join(names), stream))
    own = [spec.name for spec in recording.meta.sensor.streams]
    for name, stream in streams.items():
        for other, reference in streams.items():
            if name in own and other not in own:
                found.extend(_lags(stream, reference))
    return sorted(found, key=lambda finding: get_args(Severity).index(finding.severity))


def marking(recording: Recording) -> list[Finding]:
    """Return the findings to show with scores from a recording: findings stored by its import, or else of a check now.

    A recording simulated without devices is not checked: no clock, cable or table can have failed.
    """
    meta = recording.meta
    if FINDINGS in meta.provenance:
        with layout.readable(recording.path):
            # Earlier imports stored a count beside these.
            found = [Finding(*(one[name] for name in Finding.__annotations__)) for one in meta.provenance[FINDINGS]]
    else:
        found = [] if meta.simulated and meta.emulation is None else examine(recording)
    return [one for one in found if one.severity != "info" and one.check not in UNMARKED]


def _meta_findings(recording: Recording) -> Iterator[Finding]:
    meta = recording.meta
    if meta.excluded:
        yield Finding("excluded", "warning", f"excluded from every evaluation: {meta.excluded}")
    for name, counts in meta.streams.items():
        yield from _counts(name, counts)
    absent = [spec.name for spec in (*meta.sensor.streams, *meta.reference) if spec.name not in recording.stream_names]
    if absent:
        yield Finding("absent", "warning", f"declared but not recorded: {', '.join(absent)}")


def _counts(stream: str, counts: StreamCounts) -> Iterator[Finding]:
    again = counts.duplicates + counts.late
    open_rows = counts.received - counts.written - counts.dropped - again
    lost = f"{counts.gaps} rows were not received, {counts.dropped} were dropped because writing was too slow"
    kinds: tuple[tuple[str, Severity, int, str], ...] = (
        ("lost", "warning", counts.gaps + counts.dropped, lost),
        ("repeated", "info", again, f"{again} rows were received twice or late, and left out"),
        ("unaccounted", "warning", open_rows, f"{open_rows} received rows are neither written nor counted"),
    )
    yield from (Finding(check, kind, f"{stream}: {text}", stream) for check, kind, count, text in kinds if count)


def _channels(stream: _Stream) -> Iterator[Finding]:
    there = stream.rows - stream.missing

    def finding(check: str, severity: Severity, which: Array, text: str) -> Iterator[Finding]:
        names = stream.names(which)
        if names:
            yield Finding(check, severity, f"{listed(names)} {text}", stream.name, names)

    dead, varies = there == 0, (there > 1) & (stream.low < stream.high)
    yield from finding("dead", "error", dead, "without a single sample")
    yield from finding("stuck", "warning", (there > 1) & ~varies, "constant")
    saturated, places = stream.saturated > 0, np.arange(len(there))
    text = f"saturated in {stream.saturated.sum()} of {saturated.sum() * stream.rows} samples"
    yield from finding("saturated", "warning", saturated, text)
    for count in dict.fromkeys(stream.missing[(stream.missing > 0) & ~dead].tolist()):
        yield from finding(
            "missing", "info", stream.missing == count, f"without a sample in {count} of {stream.rows} rows"
        )
    text = f"failed parity, checksum or sequence in {stream.suspect.sum()} samples"
    yield from finding("suspect", "warning", stream.suspect > 0, text)
    # Two channels that always read the same are one, wired or parsed twice; constant ones may agree by accident.
    alike: dict[bytes, list[int]] = {}
    for place in np.flatnonzero(varies).tolist():
        alike.setdefault(stream.contents[place], []).append(place)
    for some in alike.values():
        if len(some) > 1:
            yield from finding("duplicated", "warning", np.isin(places, some), "identical")


def _clock_fit(name: str, clock: StreamClock, stream: _Stream) -> Iterator[Finding]:
    lasts_ns = 0 if stream.t_ns is None else int(stream.t_ns[-1] - stream.t_ns[0])
    wrong = [refused for one in clock.segments if (refused := wrong_rate(name, one.drift, lasts_ns))]
    if wrong:
        yield Finding("clock-rate", "error", wrong[0], name)
    if clock.breaks:
        text = f"the device clock of {name} restarted (times: {clock.breaks})"
        yield Finding("clock-lost", "warning", text, name)


def _clock(stream: str, data: _Stream) -> Iterator[Finding]:
    if data.t_ns is None or len(data.t_ns) < 2:
        return
    steps = np.diff(data.t_ns)
    backward, doubled = int((steps < 0).sum()), int((steps == 0).sum())
    if backward:
        row = int(np.flatnonzero(steps < 0)[0]) + 1
        text = f"times of {stream} run backwards at {backward} rows, first at row {row}; a full counter: `wraps_at`?"
        yield Finding("backward", "error", text, stream)
    if doubled:
        text = f"{doubled} of {len(data.t_ns)} time stamps of {stream} equal the stamp before"
        yield Finding("repeated-time", "warning", text, stream)
    steps.sort()  # in place: there may be tens of millions
    forward = steps[backward + doubled :]
    if len(forward) < 3:
        return
    median = 1e-9 * float(forward[len(forward) // 2])
    gaps = len(forward) - int(np.searchsorted(forward, 1e9 * GAP * median, side="right"))
    if gaps:
        text = f"{gaps} gaps in {stream}: up to {1e-9 * forward[-1]:.3g} s, where the median step is {median:.3g} s"
        yield Finding("gaps", "warning", text, stream)
    rate = (len(data.t_ns) - 1) / (float(data.t_ns[-1] - data.t_ns[0]) * 1e-9) if not backward else 1 / median
    stated = data.spec.rate_hz
    slow, fast = (stated / WRONG_UNIT, stated * WRONG_UNIT) if stated else (SLOWEST_HZ, np.inf)
    looks = ": were ms read as s?" if rate < slow else ": were s read as ms?" if rate > fast else ""
    if data.t_ns[0] > DATED_NS:
        looks = ""
    if looks or (stated and abs(rate - stated) > RATE_TOLERANCE * stated):
        nominal = f"; {stated:g} Hz are stated" if stated else ""
        yield Finding("rate", "warning", f"{stream} runs at {rate:.4g} Hz{nominal}{looks}", stream)


def _lags(sensor: _Stream, reference: _Stream) -> Iterator[Finding]:
    forces = np.array([one.kind == "force" for one in reference.spec.channels])
    own, other = sensor.t_ns, reference.t_ns
    if own is None or other is None or not forces.any() or all(one.kind != "taxel" for one in sensor.spec.channels):
        return
    if any(len(t_ns) < FEWEST_ROWS or (t_ns[1:] < t_ns[:-1]).any() for t_ns in (own, other)):
        return
    lags: list[tuple[str, tuple[float, float]]] = []
    for place, window in windows(own, other).items():
        lag = find_lag(*sensor.between("taxel", *window), *reference.between("force", *window))
        if lag is not None:
            ends = {" at the beginning": lag.beginning, " at the end": lag.end}
            lags += (ends if lag.drifts and not place else {place: lag.middle}).items()
    if lags:
        names = reference.names(forces)
        text = ", ".join(
            f"{1e3 * abs(late):.0f} ± {max(2e3 * error, 1):.0f} ms {'behind' if late > 0 else 'ahead of'} "
            f"{listed(names)}{place}"
            for place, (late, error) in lags
        )
        yield Finding("lag", "warning", f"{sensor.name} is {text}", sensor.name, names)


def is_copy(one: FloatArray, other: FloatArray, recording: IntArray | None = None) -> bool:
    """Return True if a column is a monotone function of another column shifted by at most `LAG` rows.

    `one` and `other` are (n,) numbers, NaN where there is no sample; `recording` is the number of each row's recording,
    (n,), as only rows of one recording are compared. None: there is one recording.

    A map is monotone if the rank correlation gamma of Goodman and Kruskal (1954) is 1 or -1: no two rows have opposite
    order. Ties do not count, so that rounding does not hide a copy; if a column has fewer than `FEWEST_VALUES` distinct
    values, the map must be linear.
    """
    there = np.isfinite(one) & np.isfinite(other)
    one, other = one[there], other[there]
    whose = np.zeros(len(one)) if recording is None else recording[there]
    with np.errstate(divide="ignore", invalid="ignore"):  # of what never changes there is no correlation
        if len(one) > 2 and abs(np.corrcoef(one, other)[0, 1]) > COPY:
            return True

    def monotone(lag: int, step: int, fewest: int) -> bool:
        later, earlier = (slice(max(start, 0), len(one) + min(start, 0), step) for start in (lag, -lag))
        paired = whose[later] == whose[earlier]
        x, y = one[later][paired], other[earlier][paired]
        in_order = any(bool((np.diff(up[np.lexsort((up, y))]) >= 0).all()) for up in (x, -x))
        return in_order and min(len(np.unique(x)), len(np.unique(y))) >= fewest

    if min(len(np.unique(one)), len(np.unique(other))) < FEWEST_VALUES:
        return False
    glance = 1 + len(one) // GLANCE
    return any(monotone(lag, glance, 1) and monotone(lag, 1, FEWEST_VALUES) for lag in range(-LAG, LAG + 1))
