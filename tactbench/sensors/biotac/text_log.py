"""Reader of BioTac text logs, as written by the maker's tools for the Cheetah adapter.

A line is ``time batch frame channel value parity [value parity ...]``, separated by blanks, one pair for each sensor;
time in seconds with six decimals, 0.000000 throughout where the host's clock was not read; channel the number of the
sampling command; parity 1 means bad [sourced: kth-ros-pkg/biotac_driver, ``bt_save_buffer_data`` in ``biotac.c``].
Newer tools write a header that ends with ``Begin File`` [sourced: SynTouch QuickStart Guide]; its layout is not
certain: only a number after ``SampRate:`` and lines that begin with ``Date:`` or ``Time:`` are read from it. Written
from these documents; no real log has been read.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tactbench.plugin import DataError, Source
from tactbench.plugin.devices import DeviceLog, read_options
from tactbench.sensors.biotac.codec import CHANNELS, NAMES, Fault, Reply
from tactbench.sensors.biotac.frames import FrameRows, LogOptions, quality_of, streams_of

_LONGEST_S = 9e9
"""Largest time [s] that is read, such that nanoseconds fit in 64 bits."""
_MOST_FRAMES = 2**26
"""Largest frame number that is read: more than a week of frames."""


class _Line(NamedTuple):
    time_s: float
    frame: int
    channel: str
    reply: Reply


def read_log(path: Path, options: Mapping[str, Any]) -> DeviceLog:
    """Read a BioTac's text log, as ``SensorDescriptor.log_reader`` requires.

    Words that the log lacks are marked missing; sequence numbers count from the log's own frame numbers. The order of a
    frame is that of most frames of the log. Error replies cannot be distinguished from wrong parity: the log has
    only the resulting number. Times are those of the log; without any they are row numbers over the rate, if the option
    `rate_hz` or the header states one. The rate of a log with times is measured from its first and last row. Options
    are those of :class:`~tactbench.sensors.biotac.frames.LogOptions`.

    Raises
    ------
    UsageError
        If an option is unknown.
    DataError
        If the file cannot be read, or has no sample of the sensor.
    """
    settings = read_options(LogOptions, options, "a log of biotac")
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror}.", hint="Give the path of a text log.") from error
    begin = next((n for n, line in enumerate(lines) if "begin file" in line.lower()), -1)
    header = "\n".join(lines[: max(begin, 0)])
    counts: Counter[str] = Counter()
    frames = _frames(lines[begin + 1 :], settings.sensor, counts)
    if not frames:
        raise DataError(
            f"No line of the log has a sample of sensor {settings.sensor}; {counts.total()} lines have other contents.",
            hint="Give a log with lines: time batch frame channel value parity, the last two for each sensor.",
        )
    order = Counter(tuple(line.channel for line in frame) for frame in frames).most_common(1)[0][0]
    timed = any(line.time_s != 0.0 for frame in frames for line in frame)
    rows = FrameRows(order)
    samples: list[tuple[int, float]] = []
    for frame in frames:
        place = -1
        for line in frame:
            try:
                place = order.index(line.channel, place + 1)
            except ValueError:
                counts["lines: out of the frame's order"] += 1
                continue
            if line.reply.fault is not None:
                counts[f"{line.reply.fault} {line.channel}"] += 1
            position = line.frame * len(order) + place
            t_ns = round(line.time_s * 1e9) if timed else None
            rows.put(position, line.reply.value or 0, quality_of(line.reply), t_ns)
            samples.append((position, line.time_s))
    rate_hz, source = _rate(settings, header, samples)
    streams, blocks = streams_of(order, rate_hz, source), rows.blocks(incomplete=True)
    if not timed and rate_hz is not None:
        period_ns = {stream.name: 1e9 / stream.rate_hz for stream in streams if stream.rate_hz is not None}
        blocks = [
            replace(block, t_ns=np.round(block.sequence * period_ns[block.stream]).astype(np.int64))
            for block in blocks
            if block.sequence is not None
        ]
    return DeviceLog(
        streams=streams,
        blocks=blocks,
        clock="host" if timed else "nominal" if rate_hz is not None else "none",
        started=" ".join(re.findall(r"^\s*(?:Date|Time):\s*(.*\S)", header, re.MULTILINE)),
        remarks=(
            "read as the maker's documents describe the text log; an error reply looks like bad parity in it",
            *(() if timed else ("the log has no times",)),
        ),
        counts=counts,
    )


def _frames(lines: Sequence[str], sensor: int, counts: Counter[str]) -> list[list[_Line]]:
    """Return a sensor's lines grouped by frame; other lines are counted in `counts` by reason."""
    frames: list[list[_Line]] = []
    for words in filter(None, map(str.split, lines)):
        line = _read(words, sensor)
        if line is None:
            counts["lines: unreadable"] += 1
        elif line.channel not in CHANNELS:
            counts["lines: channel not of this sensor"] += 1
        else:
            if not frames or frames[-1][-1].frame != line.frame:
                frames.append([])
            frames[-1].append(line)
    return frames


def _read(words: list[str], sensor: int) -> _Line | None:
    """Return the sample in a line's words for one sensor, or None if the line is not a sample."""
    pair = words[4 + 2 * sensor : 6 + 2 * sensor]
    if len(words) % 2 or len(pair) < 2:
        return None
    try:
        time_s = float(words[0])
        _, frame, channel, count, parity = (int(word) for word in (*words[1:4], *pair))
    except ValueError:
        return None
    if not (abs(time_s) < _LONGEST_S and 0 <= frame < _MOST_FRAMES and 0 <= count <= 4095 and parity in (0, 1)):
        return None
    if parity and count == 0:
        # What an absent sensor's columns read [sourced: QuickStart Guide].
        reply = Reply(None, Fault.NOT_CONNECTED)
    else:
        reply = Reply(count, Fault.PARITY if parity else None)
    return _Line(time_s, frame, NAMES.get(channel, ""), reply)


def _rate(
    settings: LogOptions, header: str, samples: Sequence[tuple[int, float]]
) -> tuple[float | None, Source | None]:
    """Return sampling commands per second and their source: the option, the header, or the log's times."""
    if settings.rate_hz is not None:
        return settings.rate_hz, Source(tag="sourced", reference="option rate_hz of the import")
    stated = re.search(r"SampRate:\s*([1-9]\d*)", header)
    if stated is not None:
        return float(stated[1]), Source(tag="sourced", reference="SampRate in the log's header")
    (first, first_s), (last, last_s) = samples[0], samples[-1]
    if last_s > first_s and last > first:
        return (last - first) / (last_s - first_s), Source(tag="measured", reference="the log's times")
    return None, None
