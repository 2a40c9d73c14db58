"""Frames of the BioTac: which word to send next, and replies to samples of the spec's two streams.

No input or output, no clock of its own: whoever drives the bus asks for the next word, sends it, and hands back what
was clocked out. Nothing is interpolated: a sample that did not come is marked missing.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import Block, Quality
from tactbench.sensors.biotac.channels import CONVERTER_TOP, STREAMS
from tactbench.sensors.biotac.codec import CHANNELS, INDEX, RESEND, Fault, Reply, decoded, sampling_command
from tactbench.sensors.biotac.electrodes import NAMES

if TYPE_CHECKING:
    import numpy.typing as npt

DEFAULT_FRAME: tuple[str, ...] = tuple(
    name for slow in (*NAMES, "PDC", "TAC", "TDC") for name in (slow, "PAC")
)  # fmt: skip
"""44 commands, every second one PAC [sourced: kth-ros-pkg/biotac_driver, BT_FRAME_STRUCTURE_DEFAULT]."""


def quality_of(reply: Reply) -> Quality:
    """Return what is wrong with a reply as a sample.

    A word of bad parity keeps the number that came and is SUSPECT: at least one of its bits is wrong. Without a datum a
    sample is MISSING; at either end of the converter it is SATURATED.
    """
    if reply.value is None:
        return Quality.MISSING
    if reply.fault is not None:
        return Quality.SUSPECT
    return Quality.SATURATED if reply.value in (0, int(CONVERTER_TOP)) else Quality.GOOD


@dataclass
class _Row:
    sequence: int
    t_ns: int | None
    data: npt.NDArray[np.uint16]
    quality: npt.NDArray[np.uint8]
    to_come: int


class FrameRows:
    """Gathers words, in the order of a frame, into rows of the spec's streams.

    The k-th word of a channel within a frame belongs to the k-th of that stream's rows. A row ends when all of its
    words are there or a word of another row comes; words that did not come are MISSING. A row of which no word came is
    absent: a gap in the sequence numbers.

    Parameters
    ----------
    frame
        Names of channels in the order of their commands.

    Raises
    ------
    ValueError
        If a name is none of the sensor's channels, or there is none.
    """

    def __init__(self, frame: tuple[str, ...]) -> None:
        unknown = [name for name in frame if name not in CHANNELS]
        if unknown or not frame:
            raise ValueError(f"a frame is of one or more of {', '.join(CHANNELS)}; got {', '.join(unknown) or 'none'}")
        columns = {
            channel.name: (k, column)
            for k, stream in enumerate(STREAMS)
            for column, channel in enumerate(stream.channels)
        }
        times = Counter(frame)
        self.frame = frame
        self._rows_per_frame = [max(times[channel.name] for channel in stream.channels) for stream in STREAMS]
        seen: Counter[str] = Counter()
        self._places: list[tuple[int, int, int]] = []
        for name in frame:
            self._places.append((*columns[name], seen[name]))
            seen[name] += 1
        self._expected: Counter[tuple[int, int]] = Counter((k, nth) for k, _, nth in self._places)
        self._open: list[_Row | None] = [None] * len(STREAMS)
        self._done: list[list[_Row]] = [[] for _ in STREAMS]

    def put(self, position: int, t_ns: int | None, count: int, quality: Quality) -> None:
        """Add one word.

        Parameters
        ----------
        position
            Number of its command since the first of all, frame after frame.
        t_ns
            When it was sampled, in nanoseconds, if that is known. A row has the time of its first word.
        count
            The datum; of no meaning if MISSING.
        quality
            What is wrong with it.
        """
        frame, place = divmod(position, len(self.frame))
        k, column, nth = self._places[place]
        sequence = frame * self._rows_per_frame[k] + nth
        row = self._open[k]
        if row is None or row.sequence != sequence:
            self._close(k)
            width = len(STREAMS[k].channels)
            row = _Row(
                sequence,
                t_ns,
                np.zeros(width, dtype=STREAMS[k].dtype),
                np.full(width, Quality.MISSING, dtype=np.uint8),
                self._expected[k, nth],
            )
            self._open[k] = row
        row.data[column], row.quality[column] = count, quality
        row.to_come -= 1
        if row.to_come == 0:
            self._close(k)

    def _close(self, k: int) -> None:
        row = self._open[k]
        if row is not None:
            self._done[k].append(row)
            self._open[k] = None

    def close(self) -> None:
        """End every row that is begun."""
        for k in range(len(STREAMS)):
            self._close(k)

    def blocks(self) -> list[Block]:
        """Return the rows that ended since the last call, a block a stream that has any."""
        found = []
        for stream, rows in zip(STREAMS, self._done, strict=True):
            if rows:
                times = [row.t_ns for row in rows if row.t_ns is not None]
                found.append(
                    Block(
                        stream=stream.name,
                        t_ns=np.array(times, dtype=np.int64) if len(times) == len(rows) else None,
                        data=np.stack([row.data for row in rows]),
                        quality=np.stack([row.quality for row in rows]),
                        sequence=np.array([row.sequence for row in rows], dtype=np.int64),
                    )
                )
                rows.clear()
        return found


@dataclass
class _Asked:
    """The command that was sent last."""

    position: int
    channel: str
    t_ns: int
    resends: int
    reply: Reply | None = None
    surplus: int = 0
    waiting: bool = True


class FrameScheduler:
    """Says which word to send next and turns replies into samples, for one sensor.

    For each command: send :meth:`word`, pause, clock two bytes out, :meth:`take` them; while :attr:`resend_due`, do so
    once more. A command that could not be sent in its time is passed over with :meth:`skip`, so that sequence numbers
    stay with the time. Several sensors on one bus have a scheduler each, of equal frames: their next words are equal
    and are sent to all at once, resends to one alone.

    The device counts nothing itself: the sequence number of a row is the host's own count of commands. A reply that
    repeats the word before it cannot be told by its bytes.

    Parameters
    ----------
    frame
        Names of channels in the order of their commands.
    resends
        How often a word of bad parity is asked for again. What never came is not: if the command was lost, the last
        two bytes would be another channel's.

    Attributes
    ----------
    faults
        For each channel, how often which :class:`~tactbench.sensors.biotac.codec.Fault` was seen, resends included.
    resent
        For each channel, how many words came good only when asked for again.
    resend_due
        Whether the next word repeats the last one, to be sent at once.

    Raises
    ------
    ValueError
        For a frame that is none, as :class:`FrameRows`.
    """

    def __init__(self, frame: tuple[str, ...] = DEFAULT_FRAME, *, resends: int = 1) -> None:
        self._rows = FrameRows(frame)
        self._resends = resends
        self._position = 0
        self._asked: _Asked | None = None
        self.resend_due = False
        self.faults: dict[str, Counter[Fault]] = {name: Counter() for name in dict.fromkeys(frame)}
        self.resent: Counter[str] = Counter()

    def word(self, t_ns: int) -> bytes:
        """Return the two bytes to send now, at `t_ns` nanoseconds of the host's clock."""
        if self.resend_due and self._asked is not None:
            self.resend_due = False
            self._asked.resends -= 1
            self._asked.waiting = True
            return RESEND
        self._settle()
        channel = self._rows.frame[self._position % len(self._rows.frame)]
        self._asked = _Asked(self._position, channel, t_ns, self._resends)
        self._position += 1
        return sampling_command(INDEX[channel])

    def take(self, reply: bytes) -> None:
        """Take what was clocked out after the last word; empty if nothing came.

        Of more than two bytes the first two are the reply and each further word is a duplicate, as is a reply when none
        is waited for; the sample is then SUSPECT. What comes before the first word or after :meth:`finish` is ignored.
        """
        asked = self._asked
        if asked is None:
            return
        if asked.waiting:
            asked.waiting = False
            self._answer(asked, reply[:2])
            reply = reply[2:]
        more = (len(reply) + 1) // 2
        if more:
            asked.surplus += more
            self.faults[asked.channel][Fault.DUPLICATE] += more

    def _answer(self, asked: _Asked, word: bytes) -> None:
        found = decoded(word)
        if found.fault is not None:
            self.faults[asked.channel][found.fault] += 1
        if asked.reply is None:
            asked.reply = found
        elif found.fault is None:
            asked.reply = found
            self.resent[asked.channel] += 1
        self.resend_due = found.fault in (Fault.PARITY, Fault.RESERVED) and asked.resends > 0

    def skip(self, words: int) -> None:
        """Pass over the next `words` commands, which are not sent: their samples are missing."""
        self._settle()
        self._position += words

    def finish(self) -> None:
        """End the rows that are begun: nothing more is sent."""
        self._settle()
        self._rows.close()

    def blocks(self) -> list[Block]:
        """Return the samples of rows that ended since the last call, raw counts with their quality.

        A row of ``electrodes`` is one frame. Its time is that of the frame's first command but PAC; in the default
        frame the others follow every 454.5 us, TDC 9.5 ms later. A row of ``vibration`` is one word with its own time.
        """
        return self._rows.blocks()

    def _settle(self) -> None:
        """Make the last command's reply a sample."""
        asked, self._asked, self.resend_due = self._asked, None, False
        if asked is None:
            return
        if asked.reply is None:
            asked.reply = Reply(None, Fault.NO_REPLY)
            self.faults[asked.channel][Fault.NO_REPLY] += 1
        quality = quality_of(asked.reply) | (Quality.SUSPECT if asked.surplus else Quality.GOOD)
        self._rows.put(asked.position, asked.t_ns, asked.reply.value or 0, quality)
