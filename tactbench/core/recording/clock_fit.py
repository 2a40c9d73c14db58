"""Conversion of a device's times to the host's clock, from the times at which its samples were received.

A sample is received later than it was taken, by a constant least delay and a varying delay. So the line that converts
device times to host times lies below all (device, host) points and touches those of least delay: an edge of the points'
lower convex hull, while a least-squares line follows the mean delay. Moon, Skelly and Towsley 1999 and Zhang, Liu and
Xia 2002 [sourced: abstracts]; the dual of their linear program shows that the hull edge over the middle is the line
below all points with the least sum of distances [derived].

A recording stores times of the host's clock; for devices with a clock of their own, such lines compute these times.
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
"""Length of the stretch to which one line is fitted [ns]. Clock rates vary: at 1 ppm with a period of 600 s, one line
over 600 s errs by 190 us, lines over 30 s by some us [measured: studies/clock_fit.py]. Shorter stretches have fewer
samples of least delay."""
LEAP_NS = STRETCH_NS // 2
"""Step of the device's times [ns] above which a new run of lines begins, as two stretches would not overlap."""
WINDOWS = 6
"""Number of windows into which a stretch is divided to compute the error bound of its line."""
LOWEST = 10
"""Number of smallest residuals in each window from which the error bound is computed."""
_SLACK_NS = 1e-3
"""Distance [ns] below a line up to which a point counts as on it; float64 rounds residuals to 1e-5 ns [derived]."""

MOST_DRIFT, JITTER_NS = 1e-2, 100_000_000
"""Largest relative rate error of a device's clock, a hundred times a quartz clock's, and largest delay of the host's
time stamps [ns], because of which a slope over a short time is uncertain (assumed)."""


def wrong_rate(stream: str, drift: float, lasts_ns: int) -> str:
    """Return a message about a device's clock with an impossible rate error `drift`; empty if the error is possible."""
    if abs(drift) * lasts_ns / max(1.0, abs(drift)) < JITTER_NS or abs(drift) <= MOST_DRIFT:
        return ""
    return f"one second of the device clock of {stream} lasts {1 + drift:.4g} s: are its times in nanoseconds?"


def one_way(run: int, stamps: tuple[IntArray, IntArray] | IntArray) -> ClockSegment:
    """Return the line below all points of a run; `stamps` are the device's and the host's times, (2, n) [ns].

    Notes
    -----
    Error bound: in each of six windows of equal numbers of points, the ten smallest residuals r1 <= ... <= r10 limit
    the error of a linear clock to [-r1, r10 - 2 r1]. The bound is the largest magnitude in any window plus, for changes
    of the clock's rate, the largest step of r1 between neighbouring windows [derived]. The bound assumes that some
    delays in each window are near their least value; fewer than sixty points give no bound.
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
    """Fit of lines to the device's and the host's times of a stream; memory holds at most 37.5 s of these times.

    Every 15 s, a line is fitted to 30 s of times; the last line of a run is fitted to the rest, 22.5 to 37.5 s. A new
    run of lines begins where the device's times go back, or leap ahead by more than 15 s.

    Parameters
    ----------
    stretch_ns
        Length of the stretch to which one line is fitted [ns].
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
        """Number of steps back in the device's times."""
        return self._runs.breaks

    def add(self, device_ns: IntArray, host_ns: IntArray) -> None:
        """Add the device's and the host's times of the next rows, (n,) [ns] each, in order."""
        run = self._runs.count(device_ns)
        for number in np.unique(run).tolist():
            self._extend(number, np.stack((device_ns, host_ns))[:, run == number])

    def segments(self) -> tuple[ClockSegment, ...]:
        """Return the lines fitted to all rows added so far."""
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
    """Counter of runs of a device's times; a run ends where the times go back, or leap ahead by more than 15 s."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._run = 0

        self.breaks = 0
        """Number of steps back in the times."""

    def count(self, device_ns: IntArray) -> IntArray:
        """Return, for each of the next rows, the number of its run, (n,), counted from 0."""
        steps = np.diff(device_ns, prepend=device_ns[:1] if self._last is None else self._last)
        self.breaks += int(np.count_nonzero(steps < 0))
        run = self._run + np.cumsum((steps < 0) | (steps > LEAP_NS))
        if len(device_ns):
            self._last, self._run = int(device_ns[-1]), int(run[-1])
        return np.asarray(run, dtype=np.int64)


class HostTimes:
    """Conversion of a device's times to the host's clock, block by block, by the lines of `clock`.

    Between the middles of two lines, times are interpolated from one line to the next, so that they do not jump. Times
    keep their order as long as neighbouring lines differ by less than the 15 s between their middles.
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
        """Return the host's times, (n,) [ns], for the device's times of the next rows.

        Raises
        ------
        FormatError
            If a run of the times has no line.
        """
        run = self._runs.count(device_ns)
        host = np.empty(len(device_ns), dtype=np.int64)
        for number in np.unique(run).tolist():
            if number not in self._lines:
                raise FormatError(
                    f"No fitted line converts run {number} of a device's times to the host's clock.",
                    hint="Use the original file: its meta or its device times seem to be changed.",
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
    """Return the value at x = 0 and the slope of the lower convex hull's edge over x = 0; x ascends through 0.

    Start with a line through a point on either side of 0; while points lie below it, the lowest of them replaces the
    point on its side. A step is one pass over arrays, while building the whole hull would go from point to point.
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

    A stream with ``device_ns`` has a device clock unless `meta` states that its times are the host's; also in virtual
    time, where a device's link and batches delay samples as well.
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
    """Yield `blocks` with times converted to the host's clock by lines in `meta`; ``host_ns``: times of receipt."""
    times: dict[str, HostTimes] = {}
    for stream, columns in blocks:
        clock = meta.clocks.get(stream)
        if clock is not None and clock.segments and "device_ns" in columns:
            of_host = times.setdefault(stream, HostTimes(clock))
            columns = {**columns, "host_ns": columns["t_ns"], "t_ns": of_host(columns["device_ns"])}
        yield stream, columns
