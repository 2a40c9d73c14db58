"""Conversion of a device's times to the host's clock, from the times at which its samples were received.

A sample comes later than it was taken, by at least the least delay of its way and by a varying time on top. So the line
that takes device times to host times lies below all stamps and touches those that came soonest: an edge of their lower
convex hull, while a least-squares line follows the delays. Moon, Skelly and Towsley 1999 and Zhang, Liu and Xia 2002
[sourced: abstracts]; that the edge over the middle is the line below all points with the least sum of distances is the
dual of their linear program [derived].

A recording stores the host's times, put there by such lines where the device has a clock of its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from tactbench.core.errors import FormatError
from tactbench.core.recording.format import Blocks, Columns
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.recording import ClockSegment, RecordingMeta, StreamClock

STRETCH_NS = 30_000_000_000
"""Length of the stretch that one line is fitted to. Clocks wander: at 1 ppm with a period of 600 s, one line over 600 s
errs by 190 us, lines over 30 s by some us [measured: studies/clock_fit.py]. Shorter stretches hold fewer of the least
delays."""
LEAP_NS = STRETCH_NS // 2
"""A longer step of the device's times begins a new run of lines, as two stretches would not overlap."""
WINDOWS = 6
"""Number of windows of a stretch whose residuals give the bound of a line."""
LOWEST = 10
"""Number of least residuals of a window that show how near they come to the least delay."""
_SLACK_NS = 1e-3
"""A residual below minus this lies below the line; float64 holds the residuals of a stretch to 1e-5 ns [derived]."""

MOST_DRIFT, JITTER_NS = 1e-2, 100_000_000
"""Largest relative error of a device's clock, a hundred times that of a quartz, and largest delay of the host's stamps,
which makes a slope over a short time uncertain (assumed)."""


def wrong_rate(stream: str, drift: float, lasts_ns: int) -> str:
    """Return a sentence about a clock whose line over some time has a wrong slope; empty if it may be right."""
    if abs(drift) * lasts_ns / max(1.0, abs(drift)) < JITTER_NS or abs(drift) <= MOST_DRIFT:
        return ""
    return f"a second of the clock of {stream} takes {1 + drift:.4g} s of the host's: are its times nanoseconds?"


def one_way(run: int, stamps: tuple[IntArray, IntArray] | IntArray) -> ClockSegment:
    """Return the line below all points of a run; `stamps` are the device's and the host's times, (2, n), in order.

    Notes
    -----
    The bound: in each of six windows of equal numbers of points, the ten lowest residuals r1 <= ... <= r10 put the
    error of a linear clock into [-r1, r10 - 2 r1]; the bound is the largest magnitude in any window, and for the
    clock's wander the largest step of r1 between neighbouring windows on top [derived]. It is statistical: it assumes
    that delays sometimes come near their least value in each window. Below sixty points there is none.
    """
    device, host = stamps
    middle, first = (int(device[0]) + int(device[-1])) // 2, int(host[0] - device[0])
    x, y = (device - middle).astype(np.float64), (host - device - first).astype(np.float64)
    value, slope = _edge_below(x, y)
    bound = None
    if len(x) >= WINDOWS * LOWEST:
        residuals = y - (value + slope * x)
        lowest = [np.sort(np.partition(part, LOWEST - 1)[:LOWEST]) for part in np.array_split(residuals, WINDOWS)]
        least = [float(some[0]) for some in lowest]
        reach = max(max(abs(some[0]), abs(some[-1] - 2 * some[0])) for some in lowest)
        bound = int(np.ceil(reach + max(abs(b - a) for a, b in itertools.pairwise(least))))
    return ClockSegment(
        run=run, middle_ns=middle, offset_ns=first + round(value), drift=slope, bound_ns=bound, points=len(x)
    )


class ClockFit:
    """Fit of lines to a stream of device and host times; at most 37.5 s of the times are kept in memory.

    Each line is fitted to 30 s, every 15 s; the last one of a run to what is left, 22.5 to 37.5 s. Within a run the
    device's times do not go back, and leap by 15 s at most; where they do, a new run of lines begins.

    Parameters
    ----------
    stretch_ns
        What one line is fitted to.
    """

    def __init__(self, stretch_ns: int = STRETCH_NS) -> None:
        self._stretch_ns = stretch_ns
        self._runs = RunCounter()
        self._done: list[ClockSegment] = []
        self._run = 0
        self._waiting: list[IntArray] = []
        self._start_ns = 0

    @property
    def breaks(self) -> int:
        """Number of times that the device's times went back."""
        return self._runs.breaks

    def add(self, device_ns: IntArray, host_ns: IntArray) -> None:
        """Add rows: (n,) times of the device and of the host, in order."""
        run = self._runs.count(device_ns)
        for number in np.unique(run).tolist():
            self._extend(number, np.stack((device_ns, host_ns))[:, run == number])

    def segments(self) -> tuple[ClockSegment, ...]:
        """Return the lines of all rows so far."""
        return (*self._done, *self._last())

    def _last(self) -> list[ClockSegment]:
        return [one_way(self._run, np.concatenate(self._waiting, axis=1))] if self._waiting else []

    def _extend(self, run: int, stamps: IntArray) -> None:
        if run != self._run or not self._waiting:
            self._done += self._last()
            self._run, self._waiting, self._start_ns = run, [], int(stamps[0, 0])
        # Of rows that came together, the last one waited least.
        last = np.append(stamps[1, 1:] != stamps[1, :-1], True)
        self._waiting.append(stamps[:, last])
        while int(stamps[0, -1]) - self._start_ns >= self._stretch_ns * 5 // 4:
            waiting = np.concatenate(self._waiting, axis=1)
            end = int(np.searchsorted(waiting[0], self._start_ns + self._stretch_ns))
            self._done.append(one_way(self._run, waiting[:, :end]))
            self._start_ns += self._stretch_ns // 2
            self._waiting = [waiting[:, int(np.searchsorted(waiting[0], self._start_ns)) :]]


class RunCounter:
    """Counter of the runs of a device's times, which end where the times go back or leap."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._run = 0

        self.breaks = 0
        """Number of times that the times went back."""

    def count(self, device_ns: IntArray) -> IntArray:
        """Return the number of the run of each of the next rows, (n,), from 0."""
        steps = np.diff(device_ns, prepend=device_ns[:1] if self._last is None else self._last)
        self.breaks += int(np.count_nonzero(steps < 0))
        run = self._run + np.cumsum((steps < 0) | (steps > LEAP_NS))
        if len(device_ns):
            self._last, self._run = int(device_ns[-1]), int(run[-1])
        return np.asarray(run, dtype=np.int64)


class HostTimes:
    """Conversion of a device's times to the host's clock, block by block, by the lines of `clock`.

    Between the middles of two lines the one goes over into the other linearly, so that times do not jump; they keep
    their order as long as two neighbouring lines differ by less than the 15 s between their middles.
    """

    def __init__(self, clock: StreamClock) -> None:
        self._runs = RunCounter()
        self._lines: dict[int, tuple[IntArray, IntArray, FloatArray]] = {}
        for run, some in itertools.groupby(clock.segments, key=lambda segment: segment.run):
            lines = list(some)
            self._lines[run] = (
                np.array([line.middle_ns for line in lines], dtype=np.int64),
                np.array([line.offset_ns for line in lines], dtype=np.int64),
                np.array([line.drift for line in lines], dtype=np.float64),
            )

    def __call__(self, device_ns: IntArray) -> IntArray:
        """Return the host's times of the next rows, (n,) [ns].

        Raises
        ------
        FormatError
            If there is no line for some of them.
        """
        run = self._runs.count(device_ns)
        host = np.empty(len(device_ns), dtype=np.int64)
        for number in np.unique(run).tolist():
            if number not in self._lines:
                raise FormatError(
                    f"Run {number} of a device's times has no line that puts it on the host's clock.",
                    hint="Was the meta, or the device's times, changed by hand?",
                )
            here = run == number
            host[here] = _on_lines(device_ns[here], *self._lines[number])
        return host


def _on_lines(device: IntArray, middle: IntArray, offset: IntArray, drift: FloatArray) -> IntArray:
    this = np.clip(np.searchsorted(middle, device, side="right") - 1, 0, len(middle) - 1)
    then = np.minimum(this + 1, len(middle) - 1)
    since = (device - middle[this]).astype(np.float64)
    apart = np.maximum(middle[then] - middle[this], 1).astype(np.float64)
    share = np.where((then > this) & (since > 0), since / apart, 0.0)
    one = drift[this] * since
    other = (offset[then] - offset[this]) + drift[then] * (device - middle[then])
    return np.asarray(device + offset[this] + np.rint((1 - share) * one + share * other).astype(np.int64))


def _edge_below(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return the edge of the lower convex hull above x = 0, as its value there and its slope; x ascends through 0.

    A line through a point on either side is turned about one of them down to the lowest point below it, until there is
    none: a step is one pass over arrays, where a chain would go from point to point.
    """
    right_of = int(np.searchsorted(x, 0.0, side="right"))
    if x[0] == x[-1]:
        return float(y.min()), 0.0
    i, j = int(np.argmin(y[:right_of])), right_of + int(np.argmin(y[right_of:]))
    while True:
        slope = float((y[j] - y[i]) / (x[j] - x[i]))
        residuals = y - (y[i] + slope * (x - x[i]))
        lowest = int(np.argmin(residuals))
        if residuals[lowest] >= -_SLACK_NS:
            return float(y[i] - slope * x[i]), slope
        if lowest < right_of:
            i = lowest
        else:
            j = lowest


def with_clock_fits(meta: RecordingMeta, blocks: Blocks) -> RecordingMeta:
    """Return `meta` with lines fitted for every stream in `blocks` that has a device clock.

    A stream with times of its device has one unless `meta` says that its times are the host's. In virtual time, too:
    what a device's link and its batches add to a time is added there as well.
    """
    otherwise = StreamClock(source="device")
    fits: dict[str, ClockFit] = {}
    for stream, columns in blocks:
        if "device_ns" in columns and meta.clocks.get(stream, otherwise).source == "device":
            fits.setdefault(stream, ClockFit()).add(columns["device_ns"], columns["t_ns"])
    clocks = dict(meta.clocks)
    for stream, fit in fits.items():
        clocks[stream] = clocks.get(stream, otherwise).model_copy(
            update={"method": "hull-1way", "segments": fit.segments(), "breaks": fit.breaks}
        )
    return meta.model_copy(update={"clocks": clocks})


def on_host_clock(meta: RecordingMeta, blocks: Blocks) -> Iterator[tuple[str, Columns]]:
    """Yield `blocks` with times on the host's clock by the lines in `meta`, and times of arrival in ``host_ns``."""
    times: dict[str, HostTimes] = {}
    for stream, columns in blocks:
        clock = meta.clocks.get(stream)
        if clock is not None and clock.segments and "device_ns" in columns:
            of_host = times.setdefault(stream, HostTimes(clock))
            columns = {**columns, "host_ns": columns["t_ns"], "t_ns": of_host(columns["device_ns"])}
        yield stream, columns
