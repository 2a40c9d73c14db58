"""A frame a taxel; a row ends with the last taxel's, or where the next frame is of a taxel before it or the same."""

import struct
from collections.abc import Iterator, Sequence

import numpy as np
from tactbench.plugin import Quality
from tactbench.plugin.devices import CanFrame, CanLink, Options, RowDriver, RowEmulator, Sample

from tactbench_xela_uskin import STREAM, TAXELS

START, FIRST, AXES = 0x200, 0x710, 3


def encode(taxel: int, values: Sequence[float]) -> CanFrame:
    """Return the frame of taxel 0 to 15: X, Y, Z."""
    return CanFrame(FIRST + taxel, struct.pack(">xHHHx", *(round(value) for value in values)))


def decode(frame: CanFrame) -> tuple[int, tuple[int, ...]] | None:
    """Return taxel and X, Y, Z; None for a frame that is another's."""
    taxel = frame.id - FIRST
    if frame.extended or not 0 <= taxel < TAXELS or len(frame.data) != 8:
        return None
    return taxel, struct.unpack(">xHHHx", frame.data)


class USkinOptions(Options):
    """Which board."""

    board: int = 1


class USkinDriver(RowDriver[CanLink]):
    """One board. Taxels whose frame was lost are marked as missing. How the board is stopped, no source says."""

    stream, link_kind, options_kind = STREAM, CanLink, USkinOptions

    def begin(self) -> None:
        """Let it send."""
        self._heard: dict[int, tuple[int, ...]] = {}
        self._last_ns = 0
        self.link.send(CanFrame(START + self.options.board, b"\x07\x00"))

    def rows(self, received: CanFrame) -> Iterator[Sample]:
        """Return the row that a frame completes, and the one before it where that was cut short."""
        found = decode(received)
        if found is None:
            self.counted["other frames"] += 1
            return
        if self._heard and found[0] <= max(self._heard):
            yield self._row()
        self._heard[found[0]], self._last_ns = found[1], received.t_ns
        if found[0] == TAXELS - 1:
            yield self._row()

    def _row(self) -> Sample:
        values = [self._heard.get(taxel, (0, 0, 0)) for taxel in range(TAXELS)]
        missing = [Quality.GOOD if taxel in self._heard else Quality.MISSING for taxel in range(TAXELS)]
        self.counted.update({"frames lost": TAXELS - len(self._heard)} if len(self._heard) < TAXELS else {})
        self._heard = {}
        return Sample(np.ravel(values).tolist(), np.repeat(missing, AXES).tolist(), self._last_ns)


class Emulator(RowEmulator):
    """The board as a model: 16 frames at once, every 10 ms (assumed) from the start."""

    stream, rate_hz = STREAM, 100.0

    def sent(self, values: Sequence[float]) -> list[CanFrame]:
        """Return a frame for each taxel."""
        return [encode(taxel, values[AXES * taxel :][:AXES]) for taxel in range(TAXELS)]

    def told(self, piece: bytes | CanFrame, now_s: float) -> tuple[()]:
        """Start, if it is told so."""
        if isinstance(piece, CanFrame) and piece.id == START + self.settings.options.get("board", 1):
            self.sample(now_s)
        return ()
