"""The text log of the maker's tools for the Cheetah adapter, to samples.

A line is ``time batch frame channel value parity [value parity ...]``, separated by blanks, one pair for each sensor;
time in seconds with six decimals, 0.000000 throughout where the host's clock was not read; channel the number of the
sampling command; parity 1 means bad [sourced: kth-ros-pkg/biotac_driver, ``bt_save_buffer_data`` in ``biotac.c``].
Newer tools write a header that ends with ``Begin File`` [sourced: SynTouch QuickStart Guide]; its layout is not
certain, so it is handed on as it stands and nothing is read from it. Written from these documents; no real log has been
read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from tactbench.plugin import Block, DataError
from tactbench.sensors.biotac.codec import CHANNELS, INDEX, Fault, Reply
from tactbench.sensors.biotac.frames import FrameRows, quality_of

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
    blocks: list[Block]
    """A block a stream; sequence numbers count from the log's own frame numbers. No times if the log has none."""
    faults: dict[str, Counter[Fault]]
    """For each channel, how often which fault was seen."""
    left_out: Counter[str]
    """Lines that are no sample, by reason."""


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
            rows.put(line.frame * len(order) + place, t_ns, line.reply.value or 0, quality_of(line.reply))
            place += 1
    rows.close()
    return TextLog(tuple(text[: max(begin, 0)]), rows.blocks(), faults, left_out)


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
