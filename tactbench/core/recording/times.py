"""Which times a recording stores: the host's, put there by a clock fit where the device has a clock of its own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from tactbench.core.recording.clock_fit import ClockFit, HostTimes
from tactbench.core.recording.partial import Columns
from tactbench.core.spec.recording import RecordingMeta, StreamClock

Blocks = Iterable[tuple[str, Columns]]


def with_clock_fits(meta: RecordingMeta, blocks: Blocks) -> RecordingMeta:
    """Return `meta` with the lines of every stream in `blocks` that has a device clock.

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
    """Yield `blocks` as they are stored: by the lines in `meta`, with the stamps as they came in ``host_ns``."""
    times: dict[str, HostTimes] = {}
    for stream, columns in blocks:
        clock = meta.clocks.get(stream)
        if clock is not None and clock.segments and "device_ns" in columns:
            of_host = times.setdefault(stream, HostTimes(clock))
            columns = {**columns, "host_ns": columns["t_ns"], "t_ns": of_host(columns["device_ns"])}
        yield stream, columns
