"""The text log of the maker's tools for the Cheetah adapter, to samples.

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
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tactbench.plugin import Block, DataError, Source
from tactbench.plugin.devices import DeviceLog, read_options
from tactbench.sensors.biotac.codec import CHANNELS, INDEX, Fault, Reply
from tactbench.sensors.biotac.frames import FrameRows, counted, quality_of, streams_of
from tactbench.sensors.biotac.options import LogOptions

if TYPE_CHECKING:
    import numpy.typing as npt

_LONGEST_S = 9e9
"""So long a time in nanoseconds fits in 64 bits."""


class _Line(NamedTuple):
    time_s: float
    frame: int
    channel: str
    reply: Reply


@dataclass(frozen=True)
class TextLog:
    """One sensor's samples from a log."""

    header: tuple[str, ...]
    """The lines before ``Begin File``, as they stand; empty without such a line."""
    frame: tuple[str, ...]
    """Channels in the order in which most frames of the log have them."""
    blocks: list[Block]
    """A block a stream; sequence numbers count from the log's own frame numbers. No times if the log has none."""
    faults: dict[str, Counter[Fault]]
    """For each channel, how often which fault was seen."""
    left_out: Counter[str]
    """Lines that are no sample, by reason."""
    rate_hz: float | None
    """Commands a second from the first sample to the last, by the log's times; None: it has none, or they go back."""


def read_log(path: Path, options: Mapping[str, Any]) -> DeviceLog:
    """Read a log as ``SensorDescriptor.log_reader`` promises.

    Times are the log's own; a log without times has row number by rate, if the option `rate_hz` or the header states
    one. A timed log's rate is measured from its first and last row.

    Parameters
    ----------
    path
        The file.
    options
        As :class:`~tactbench.sensors.biotac.options.LogOptions`.

    Raises
    ------
    UsageError
        For options that are not known.
    DataError
        If the file cannot be read, or has no sample of the sensor.
    """
    settings = read_options(LogOptions, options, "a log of biotac")
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror}.", hint="Give a text log.") from error
    log = read_text_log(lines, settings.sensor)
    header = "\n".join(log.header)
    stated = re.search(r"SampRate:\s*([1-9]\d*)", header)
    source = None
    if settings.rate_hz is not None:
        rate_hz, source = settings.rate_hz, Source(tag="sourced", reference="option rate_hz of the import")
    elif stated is not None:
        rate_hz, source = float(stated[1]), Source(tag="sourced", reference="SampRate in the log's header")
    elif log.rate_hz is not None:
        rate_hz, source = log.rate_hz, Source(tag="measured", reference="the log's times")
    else:
        rate_hz = None
    streams, blocks = streams_of(log.frame, rate_hz, source), log.blocks
    timed = blocks[0].t_ns is not None
    if not timed and rate_hz is not None:
        rates_hz = {stream.name: stream.rate_hz for stream in streams}
        blocks = [replace(block, t_ns=_nominal_ns(block, rates_hz[block.stream])) for block in blocks]
    return DeviceLog(
        streams=streams,
        blocks=blocks,
        clock="host" if timed else "nominal" if rate_hz is not None else "none",
        started=" ".join(re.findall(r"^\s*(?:Date|Time):\s*(.*\S)", header, re.MULTILINE)),
        remarks=(
            "read as the maker's documents describe the text log; an error reply looks like bad parity in it",
            *(() if timed else ("the log has no times",)),
        ),
        counts=counted(log.faults) | {f"lines: {reason}": n for reason, n in log.left_out.items()},
    )


def _nominal_ns(block: Block, rate_hz: float | None) -> npt.NDArray[np.int64]:
    assert rate_hz is not None
    assert block.sequence is not None
    if block.sequence.max() / rate_hz > _LONGEST_S:
        raise DataError(
            f"The log's frames go up to {block.sequence.max()}, which at {rate_hz:g} a second is longer than "
            f"{_LONGEST_S:g} s.",
            hint="Check the log's third column, or give the option rate_hz.",
        )
    return np.round(block.sequence * (1e9 / rate_hz)).astype(np.int64)


def read_text_log(lines: Iterable[str], sensor: int = 0) -> TextLog:
    """Read one sensor's columns of a log.

    Words that the log lacks are marked missing. The order of a frame is that of most frames of the log. An error reply
    cannot be told from bad parity here, since the log has only the number it looks like.

    Parameters
    ----------
    lines
        The file's lines.
    sensor
        Which pair of columns, from 0.

    Raises
    ------
    DataError
        If no line holds a sample of that sensor.
    """
    text = list(lines)
    begin = next((n for n, line in enumerate(text) if "begin file" in line.lower()), -1)
    left_out: Counter[str] = Counter()
    faults: dict[str, Counter[Fault]] = {name: Counter() for name in CHANNELS}
    frames: list[list[_Line]] = []
    for words in map(str.split, text[begin + 1 :]):
        if not words:
            continue
        line = _read(words, sensor)
        if line is None:
            left_out["unreadable"] += 1
        elif line.channel not in faults:
            left_out["channel not of this sensor"] += 1
        else:
            if not frames or frames[-1][-1].frame != line.frame:
                frames.append([])
            frames[-1].append(line)
    if not frames:
        raise DataError(
            f"No line of the log holds a sample of sensor {sensor}; {left_out.total()} hold something else.",
            hint="A line is: time batch frame channel value parity, the last two for each sensor.",
        )
    order = Counter(tuple(line.channel for line in frame) for frame in frames).most_common(1)[0][0]
    timed = any(line.time_s != 0.0 for frame in frames for line in frame)
    rows = FrameRows(order)
    samples: list[tuple[int, float]] = []
    for frame in frames:
        place = 0
        for line in frame:
            try:
                place = order.index(line.channel, place)
            except ValueError:
                left_out["out of the frame's order"] += 1
                continue
            if line.reply.fault is not None:
                faults[line.channel][line.reply.fault] += 1
            t_ns = round(line.time_s * 1e9) if timed else None
            rows.put(line.frame * len(order) + place, line.reply.value or 0, quality_of(line.reply), t_ns)
            samples.append((line.frame * len(order) + place, line.time_s))
            place += 1
    rows.close()
    (first, first_s), (last, last_s) = samples[0], samples[-1]
    rate_hz = (last - first) / (last_s - first_s) if last_s > first_s and last > first else None
    return TextLog(tuple(text[: max(begin, 0)]), order, rows.blocks(), faults, left_out, rate_hz)


_NAMES = {index: name for name, index in INDEX.items()}


def _read(words: list[str], sensor: int) -> _Line | None:
    """Return one line, or None for what is none."""
    pair = words[4 + 2 * sensor : 6 + 2 * sensor]
    if len(words) % 2 or len(pair) < 2:
        return None
    try:
        time_s = float(words[0])
        _, frame, channel, count, parity = (int(word) for word in (*words[1:4], *pair))
    except ValueError:
        return None
    if not (abs(time_s) < _LONGEST_S and 0 <= frame < 2**40 and 0 <= count <= 4095 and parity in (0, 1)):
        return None
    if parity and count == 0:
        # What an absent sensor's columns read [sourced: QuickStart Guide].
        reply = Reply(None, Fault.NOT_CONNECTED)
    else:
        reply = Reply(count, Fault.PARITY if parity else None)
    return _Line(time_s, frame, _NAMES.get(channel, ""), reply)
