"""Frames without a mark at their beginning: a reader is in step where a CR LF stands after every 80 bytes."""

from collections.abc import Iterator, Sequence

import numpy as np
from tactbench.plugin import FloatArray, Quality
from tactbench.plugin.devices import ByteLink, Received, RowDriver, RowEmulator, Sample

from tactbench_anyskin import STREAM

FLOATS, END = len(STREAM.channels), b"\r\n"
SIZE = 4 * FLOATS + len(END)
LOWER, UPPER = (np.array([getattr(channel, end) for channel in STREAM.channels]) for end in ("lower", "upper"))


def encode(values: Sequence[float]) -> bytes:
    """Return a frame."""
    return np.asarray(values, dtype="<f4").tobytes() + END


def decode(data: bytes) -> tuple[list[FloatArray], bytes, int]:
    """Return the frames in `data`, what is left for the next call, and how many bytes belonged to no frame."""
    frames, start, skipped = [], 0, 0
    while len(data) - start >= SIZE:
        if data[start + SIZE - len(END) : start + SIZE] == END:
            frames.append(np.frombuffer(data, "<f4", FLOATS, start))
            start += SIZE
        else:
            start, skipped = start + 1, skipped + 1
    return frames, data[start:], skipped


class AnySkinDriver(RowDriver[ByteLink]):
    """It sends from power-on and listens to nothing; half of the first frame is usually lost, and counted."""

    stream, link_kind = STREAM, ByteLink
    _left = b""

    def begin(self) -> None:
        """Forget what came before."""
        self._left = b""

    def rows(self, received: Received) -> Iterator[Sample]:
        """Return the frames that are complete."""
        frames, self._left, skipped = decode(self._left + received.data)
        self.counted.update({"bytes of no frame": skipped} if skipped else {})
        for frame in frames:
            beyond = ~((LOWER <= frame) & (frame <= UPPER))
            self.counted.update({"readings that no chip has": int(beyond.sum())} if beyond.any() else {})
            marks = np.where(beyond, Quality.SUSPECT, Quality.GOOD) | np.where(np.isnan(frame), Quality.MISSING, 0)
            yield Sample(frame, marks.tolist())


class Emulator(RowEmulator):
    """The board as a model."""

    stream, rate_hz, from_power_on = STREAM, 140.0, True

    def sent(self, values: Sequence[float]) -> list[bytes]:
        """Return a frame."""
        return [encode(values)]
