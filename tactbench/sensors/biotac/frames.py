"""Frames of the BioTac: the words to send and their times, and conversion of replies to samples of two streams.

The module does no input or output and reads no clock: the driver takes the next batch, sends it, and returns the bytes
received. Nothing is interpolated: a sample that was not received is marked missing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import BeforeValidator, Field

from tactbench.plugin import Block, Quality, RigError, Source, StreamSpec
from tactbench.plugin.devices import Options, SpiStep
from tactbench.sensors.biotac.channels import CONVERTER_TOP, NAMES, STREAMS
from tactbench.sensors.biotac.codec import (
    CHANNELS,
    COMMAND_RATE,
    INDEX,
    RESEND,
    SAMPLING_PAUSE,
    WORD_PAUSE,
    Fault,
    Reply,
    decoded,
    sampling_command,
)

DEFAULT_FRAME: tuple[str, ...] = tuple(
    name for slow in (*NAMES, "PDC", "TAC", "TDC") for name in (slow, "PAC")
)  # fmt: skip
"""Channels of the default frame, every second PAC [sourced: kth-ros-pkg/biotac_driver, BT_FRAME_STRUCTURE_DEFAULT]."""

FILLER = b"\x00\x00"
"""Bytes that the host sends while it reads a word [sourced: driver]."""


def quality_of(reply: Reply) -> Quality:
    """Return the quality flags of a sample from a reply.

    A word of wrong parity keeps its count and is SUSPECT: at least one of its bits is wrong. A sample without datum is
    MISSING; a count at either end of the converter's range is SATURATED.
    """
    if reply.value is None:
        return Quality.MISSING
    if reply.fault is not None:
        return Quality.SUSPECT
    return Quality.SATURATED if reply.value in (0, int(CONVERTER_TOP)) else Quality.GOOD


def streams_of(frame: Sequence[str], rate_hz: float | None, source: Source | None = None) -> tuple[StreamSpec, ...]:
    """Return the spec's streams limited to the channels of `frame`, at the frame's rates.

    `rate_hz` is the rate of commands (None: not stated), `source` the source of rates that differ from the spec's.
    """
    found = []
    for stream in STREAMS:
        channels = tuple(channel for channel in stream.channels if channel.name in frame)
        if not channels:
            continue
        most = max(frame.count(channel.name) for channel in channels)
        own = None if rate_hz is None else rate_hz * most / len(frame)
        if channels != stream.channels or own != stream.rate_hz:
            stream = stream.model_copy(update={"channels": channels, "rate_hz": own, "rate_source": source})
        found.append(stream)
    return tuple(found)


@dataclass
class _Row:
    sequence: int
    t_ns: int | None
    device_ns: int | None
    data: npt.NDArray[np.uint16]
    quality: npt.NDArray[np.uint8]
    to_come: int


class FrameRows:
    """Collector of received words, in the order of a frame, into rows of the sensor's streams.

    The k-th word of a channel within a frame belongs to the k-th row of the channel's stream. A row ends when all its
    words have been received or a word of another row is; its other words are MISSING. A row without any word is absent:
    a gap in the sequence numbers. A frame is the names of channels in the order of their commands.
    """

    def __init__(self, frame: tuple[str, ...]) -> None:
        self.frame = frame
        self._streams = streams_of(frame, None)
        columns = {
            channel.name: (k, column)
            for k, stream in enumerate(self._streams)
            for column, channel in enumerate(stream.channels)
        }
        times = Counter(frame)
        self._rows_per_frame = [max(times[channel.name] for channel in stream.channels) for stream in self._streams]
        seen: Counter[str] = Counter()
        self._places: list[tuple[int, int, int]] = []
        for name in frame:
            self._places.append((*columns[name], seen[name]))
            seen[name] += 1
        self._expected: Counter[tuple[int, int]] = Counter((k, nth) for k, _, nth in self._places)
        self._rows: list[list[_Row]] = [[] for _ in self._streams]
        """Rows of each stream in order of time; the last row may be incomplete."""

    def put(
        self, position: int, count: int, quality: Quality, t_ns: int | None = None, device_ns: int | None = None
    ) -> None:
        """Add the word of the command number `position`, counted over all frames; `count` has no meaning if MISSING.

        Its times are nanoseconds of the host's clock and of the adapter's, where known; a row has those of its first
        word.
        """
        frame, place = divmod(position, len(self.frame))
        k, column, nth = self._places[place]
        sequence = frame * self._rows_per_frame[k] + nth
        rows = self._rows[k]
        if not (rows and rows[-1].to_come and rows[-1].sequence == sequence):
            data = np.zeros(len(self._streams[k].channels), dtype=self._streams[k].dtype)
            missing = np.full(data.size, Quality.MISSING, dtype=np.uint8)
            rows.append(_Row(sequence, t_ns, device_ns, data, missing, self._expected[k, nth]))
        row = rows[-1]
        row.data[column], row.quality[column] = count, quality
        row.to_come -= 1

    def blocks(self, *, incomplete: bool = False) -> list[Block]:
        """Return the rows that ended since the last call, in one block for each stream with such rows.

        With `incomplete`, the last rows end, too: words not received are marked MISSING. A row of ``electrodes`` is one
        frame. Its time is that of the frame's first command other than PAC; in the default frame further electrodes
        follow every 454.5 us, TDC after 9.5 ms. A row of ``vibration`` is one word with its own times.
        """
        found = []
        for stream, rows in zip(self._streams, self._rows, strict=True):
            left = [row for row in rows[-1:] if row.to_come and not incomplete]
            ended, rows[:] = rows[: len(rows) - len(left)], left
            if ended:
                found.append(
                    Block(
                        stream=stream.name,
                        t_ns=_times([row.t_ns for row in ended]),
                        data=np.stack([row.data for row in ended]),
                        quality=np.stack([row.quality for row in ended]),
                        sequence=np.array([row.sequence for row in ended], dtype=np.int64),
                        device_ns=_times([row.device_ns for row in ended]),
                    )
                )
        return found


def _times(times: list[int | None]) -> npt.NDArray[np.int64] | None:
    return None if None in times else np.array(times, dtype=np.int64)


class FrameBatches(FrameRows):
    """Source of the batches of SPI steps for one sensor, and collector of rows from their replies.

    A word is a sampling command, the pause, two bytes read, and a pause that fills its time. SPI adapters take whole
    microseconds, so the pauses differ by 1 us: the time of n words is n / 4400 s to 1 us, whatever the SPI clock.

    A resend repeats the last two bytes, so it must come before the next command; and a batch cannot depend on the bytes
    that it reads. So with `resends` above 0 *every* word is requested as many times again, and the first word without
    fault is used. By default there is no resend: a word of wrong parity is SUSPECT and counted. No source states the
    pause for a resend; 50 us as after a sampling command is assumed, which allows one resend at 4400 words a second.

    The sensor counts nothing itself: the sequence number of a row is the host's own count of commands. A reply that
    repeats the word before it cannot be recognised by its bytes.

    `speed_hz` is the clock of the SPI bus, `select` the mask of the sensor's select lines, `words` the number of words
    in a batch (None: a frame).

    Attributes
    ----------
    counts
        Numbers of faults in the first replies to commands by fault and channel, as ``parity E7``, and ``resent E7`` for
        words without fault in a repetition only.

    Raises
    ------
    RigError
        If `speed_hz` leaves no time for the words.
    """

    def __init__(
        self,
        frame: tuple[str, ...] = DEFAULT_FRAME,
        *,
        speed_hz: int,
        select: int = 1,
        resends: int = 0,
        words: int | None = None,
    ) -> None:
        super().__init__(frame)
        self._select = select
        self._commands = 1 + resends
        self._words = len(frame) if words is None else words
        self._speed_hz = speed_hz
        self._position = 0
        rate_hz, bits = round(COMMAND_RATE.to("Hz")), 32 * self._commands
        # Pauses of one word, in us: a quotient of whole numbers, 1e6 (1/rate - bits/speed).
        self._pauses_us = (1_000_000 * (speed_hz - bits * rate_hz), rate_hz * speed_hz)
        self._command_us, self._word_us = round(SAMPLING_PAUSE.to("us")), round(WORD_PAUSE.to("us"))
        self._within_us = self._commands * self._command_us + resends * self._word_us
        if self._paused_us(1) < self._within_us + self._word_us:
            raise RigError(
                f"A clock of {speed_hz} Hz is too slow for a BioTac: {self._commands} x {self._command_us} us, the "
                f"pauses between and {bits} bits do not fit into the time of a word, 1/{rate_hz} s.",
                hint=f"Choose a faster clock, or fewer resends than {resends}.",
            )
        self.counts: Counter[str] = Counter()

    def _paused_us(self, words: int) -> int:
        """Return the sum [us] of the pauses in the first `words` words, rounded down."""
        over, under = self._pauses_us
        return words * over // under

    def next(self) -> tuple[int, list[SpiStep]]:
        """Return the position of the next batch's first word, counted over all frames, and the batch's SPI steps."""
        first, steps = self._position, []
        self._position += self._words
        for n in range(first, self._position):
            command = sampling_command(INDEX[self.frame[n % len(self.frame)]])
            for k in range(self._commands):
                steps.append(SpiStep(RESEND if k else command, self._select, self._command_us))
                steps.append(SpiStep(FILLER, self._select, self._word_us))
            rest_us = self._paused_us(n + 1) - self._paused_us(n) - self._within_us
            steps[-1] = SpiStep(FILLER, self._select, rest_us)
        return first, steps

    def timing(self, first: int) -> tuple[list[int], int]:
        """Return the sampling times of the words in the batch from position `first` on, and the batch's end.

        Times are nanoseconds from the batch's beginning; a word is sampled at its command's last bit [assumed].
        """
        over, under = 16 * 1_000_000_000, self._speed_hz
        begins = [
            1000 * (self._paused_us(first + n) - self._paused_us(first)) + 2 * self._commands * n * over // under
            for n in range(self._words + 1)
        ]
        return [begin + over // under for begin in begins[:-1]], begins[-1]

    def take(
        self, first: int, data: Sequence[bytes], *, t_ns: int, device_ns: int | None = None, skipped: int = 0
    ) -> None:
        """Take the `data` that came in at `t_ns` during the steps of the batch with position `first`.

        `device_ns` is the beginning of the batch by the adapter's own counter. With it, rows have this clock's times
        beside `t_ns`; without it, `t_ns` counts as the batch's end and rows have the times before it at which they
        were sampled if no pause was longer than requested. `skipped` is the number of words so far (whole frames) not
        requested in their time: sequence numbers skip these frames, too.
        """
        sampled_ns, end_ns = self.timing(first)
        stride = 2 * self._commands
        for n, after_ns in enumerate(sampled_ns):
            words = data[stride * n + 1 : stride * (n + 1) : 2]
            reply = self._reply(self.frame[(first + n) % len(self.frame)], words)
            self.put(
                first + n + skipped,
                reply.value or 0,
                quality_of(reply),
                t_ns - end_ns + after_ns if device_ns is None else t_ns,
                None if device_ns is None else device_ns + after_ns,
            )

    def _reply(self, channel: str, words: Sequence[bytes]) -> Reply:
        """Return the first reply to a command or, if its parity was wrong, the first repetition without fault.

        A missing reply is not replaced by a resend: if the command was lost, the last two bytes are another channel's.
        """
        reply = decoded(words[0])
        if reply.fault is not None:
            self.counts[f"{reply.fault} {channel}"] += 1
        if reply.fault in (Fault.PARITY, Fault.RESERVED):
            for word in words[1:]:
                again = decoded(word)
                if again.fault is None:
                    self.counts[f"resent {channel}"] += 1
                    return again
        return reply


def _names(given: object) -> object:
    """Return the channel names of a frame, given as text in a rig file."""
    names = tuple(given.replace(",", " ").split()) if isinstance(given, str) else given
    if isinstance(names, tuple) and (not names or set(names) - set(CHANNELS)):
        raise ValueError(f"names of channels, separated by blanks, are expected: {', '.join(CHANNELS)}")
    return names


class BioTacOptions(Options):
    """Options of the BioTac's driver and emulator."""

    select: int = Field(default=1, ge=1, le=0xFF)
    """Mask of the select lines that are active while this sensor is addressed; line i is bit i. On the maker's board
    for several sensors 1, 2 and 4 select the first three [sourced: driver]."""
    frame: Annotated[tuple[str, ...], BeforeValidator(_names)] = DEFAULT_FRAME
    """Channels in the order of their commands, separated by blanks; 4400 commands a second whatever the frame."""
    resends: int = Field(default=0, ge=0, le=3)
    """Number of times that every word is requested again, so that words of wrong parity can be replaced."""
    batches_ahead: int = Field(default=8, ge=2, le=16)
    """Number of batches sent ahead, as far as the adapter can store them: the host may be late by their duration."""


class LogOptions(Options):
    """Options of the reader of the BioTac's text logs."""

    sensor: int = Field(default=0, ge=0)
    """Index, from 0, of the sensor: each has one pair of columns (value, parity) in the log."""
    rate_hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    """Sampling commands per second, needed if the log does not state this rate."""
