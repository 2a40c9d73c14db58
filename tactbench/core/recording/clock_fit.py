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
from collections.abc import Iterator, Sequence

import numpy as np

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


def fit(device_ns: IntArray, host_ns: IntArray, stretch_ns: int = STRETCH_NS) -> tuple[ClockSegment, ...]:
    """Return the lines that convert the device's times of a stream to the host's clock, in order of time.

    Every half stretch (15 s), a line is fitted to a stretch (30 s) of times; the last line of a run is fitted to the
    rest, 0.75 to 1.25 stretches. A new run of lines begins where the device's times go back, or leap ahead by more than
    15 s. `device_ns` and `host_ns` are (n,) times of the device and of receipt at the host [ns], in order of receipt.
    """
    found: list[ClockSegment] = []
    for run, here in _runs(device_ns):
        stamps, start_ns = np.stack((device_ns[here], host_ns[here])), int(device_ns[here.start])
        stamps = stamps[:, np.append(stamps[1, 1:] != stamps[1, :-1], True)]  # of rows received together the last one
        while int(stamps[0, -1]) - start_ns >= stretch_ns * 5 // 4:
            found.append(one_way(run, stamps[:, : int(np.searchsorted(stamps[0], start_ns + stretch_ns))]))
            start_ns += stretch_ns // 2
            stamps = stamps[:, int(np.searchsorted(stamps[0], start_ns)) :]
        found.append(one_way(run, stamps))
    return tuple(found)


def _runs(device_ns: IntArray) -> Iterator[tuple[int, slice]]:
    """Divide a device's times where its clock restarts or leaps; yield each part's number, from 0, and its rows."""
    steps = np.diff(device_ns)
    edges = [0, *(np.flatnonzero((steps < 0) | (steps > LEAP_NS)) + 1).tolist(), len(device_ns)]
    yield from ((run, slice(*rows)) for run, rows in enumerate(itertools.pairwise(edges)) if len(device_ns))


def host_times(segments: Sequence[ClockSegment], device_ns: IntArray) -> IntArray:
    """Return the host's times, (n,) [ns], of all the device's times of a stream, by fitted lines.

    Between the middles of two lines, times are interpolated from one line to the next, so that they do not jump. Times
    keep their order as long as neighbouring lines differ by less than the 15 s between their middles.
    """
    host = np.empty(len(device_ns), dtype=np.int64)
    for run, here in _runs(device_ns):
        lines = [line for line in segments if line.run == run]
        middle, offset = (np.array([getattr(line, name) for line in lines]) for name in ("middle_ns", "offset_ns"))
        host[here] = _on_lines(device_ns[here], middle, offset, np.array([line.drift for line in lines]))
    return host


def _on_lines(device: IntArray, middle: IntArray, offset: IntArray, drift: FloatArray) -> IntArray:
    this = np.clip(np.searchsorted(middle, device, side="right") - 1, 0, len(middle) - 1)
    then = np.minimum(this + 1, len(middle) - 1)
    since = device - middle[this]
    share = np.clip(since / np.maximum(middle[then] - middle[this], 1), 0, 1)
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


def on_host_clock(meta: RecordingMeta, stamps: dict[str, IntArray]) -> tuple[RecordingMeta, dict[str, IntArray]]:
    """Return `meta` with lines fitted for each stream with a device clock, and the host's times, (n,) [ns], by stream.

    `stamps` are the device's and the host's times, (2, n) [ns], by stream. Each of these streams has a device clock
    unless `meta` states that its times are the host's. This also holds in virtual time, where a device's link and
    batches delay samples as well.
    """
    clocks, times = dict(meta.clocks), {}
    for stream, (device_ns, host_ns) in stamps.items():
        clock = clocks.get(stream, StreamClock(source="device"))
        if clock.source == "device":
            lines, breaks = fit(device_ns, host_ns), int(np.count_nonzero(np.diff(device_ns) < 0))
            times[stream] = host_times(lines, device_ns)
            fitted = {"method": "hull-1way", "segments": lines, "breaks": breaks}
            clocks[stream] = clock.model_copy(update=fitted)
    return meta.model_copy(update={"clocks": clocks}), times
