"""The gauge stream: six gauge voltages from a microcontroller as frames, without input or output.

The format is this project's own, version 1; ``docs/links.md`` specifies it. No maker's device speaks it.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import Field

from tactbench.plugin import RigError
from tactbench.plugin.devices import Frame, FrameDecoder, Options, Received, encode_frame

VERSION = 1
RANGE_V = 10.0
"""A converter's range, to both sides of zero."""
STEP_V = RANGE_V / (1 << 15)
"""One count [V]."""

_ABOUT = struct.Struct("<HI")
"""Head of an ABOUT frame: firmware, rate in millihertz; its name follows."""
SAMPLES = np.dtype([("counter", "<u4"), ("micros", "<u4"), ("counts", "<i2", (6,))])
"""Payload of a GAUGES frame."""


class Nano17Options(Options):
    """What a rig file says of a Nano17 and its converter."""

    calibration: str
    """The sensor's ``.cal`` file."""
    rate_hz: float = Field(default=1000.0, gt=0.0, le=20_000.0)
    """Samples a second that the firmware is built for."""
    bias_samples: int = Field(default=100, ge=0, le=100_000)
    """Averaged at the start as the reading of the unloaded sensor; 0: none, the sensor is loaded then. As many are
    averaged, 100 at least, when it is told to tare."""


class StreamKind(IntEnum):
    """Frames that a device sends unasked."""

    GAUGES = 0x20
    ABOUT = 0x21


class About(NamedTuple):
    """What the microcontroller says of itself, once a second."""

    firmware: int
    rate_hz: float
    name: str


class GaugeSamples(NamedTuple):
    """Samples, in the order of arrival."""

    counter: npt.NDArray[np.int64]
    """(n,) of the samples, modulo 2^32."""
    micros: npt.NDArray[np.int64]
    """(n,) microseconds of the microcontroller when the sample was taken, modulo 2^32."""
    counts: npt.NDArray[np.int16]
    """(n, 6) of :data:`STEP_V`."""


def encode_sample(counter: int, micros: int, counts: tuple[int, ...]) -> bytes:
    """Return the frame of one sample; counter and microseconds are taken modulo 2^32."""
    low = counter & 0xFFFFFFFF
    payload = struct.pack("<II6h", low, micros & 0xFFFFFFFF, *counts)
    return encode_frame(Frame(StreamKind.GAUGES, low & 0xFFFF, payload))


def encode_about(about: About) -> bytes:
    """Return the frame in which the microcontroller speaks of itself."""
    payload = _ABOUT.pack(about.firmware, round(1e3 * about.rate_hz)) + about.name.encode("ascii")
    return encode_frame(Frame(StreamKind.ABOUT, 0, payload))


class GaugeReader:
    """Bytes as they come into samples.

    Attributes
    ----------
    about
        What the microcontroller said last; None: nothing yet.
    unknown
        Whole frames of other kinds or lengths so far.
    """

    def __init__(self) -> None:
        self.about: About | None = None
        self.unknown = 0
        self._decoder = FrameDecoder()
        self._payloads: list[bytes] = []
        self._stamps: list[int] = []

    @property
    def damaged(self) -> int:
        """How many frames came damaged so far."""
        return self._decoder.damaged

    def __len__(self) -> int:
        return len(self._payloads)

    def feed(self, received: Received) -> None:
        """Take what came; `taken` gives the samples.

        Raises
        ------
        RigError
            If the other end speaks another version of the format.
        """
        for frame, t_ns in self._decoder.stamped(received):
            if frame.version != VERSION:
                raise RigError(
                    f"The microcontroller speaks version {frame.version} of the gauge stream, expected is {VERSION}.",
                    hint="Update its firmware, or tactbench.",
                )
            if frame.kind == StreamKind.GAUGES and len(frame.payload) == SAMPLES.itemsize:
                self._payloads.append(frame.payload)
                self._stamps.append(t_ns)
            elif frame.kind == StreamKind.ABOUT and len(frame.payload) >= _ABOUT.size:
                firmware, rate = _ABOUT.unpack_from(frame.payload)
                self.about = About(firmware, rate / 1e3, frame.payload[_ABOUT.size :].decode("ascii", "replace"))
            else:
                self.unknown += 1

    def taken(self) -> tuple[GaugeSamples, npt.NDArray[np.int64]]:
        """Return the samples since the last call, and when the first byte of each frame was in the host [ns]."""
        found = np.frombuffer(b"".join(self._payloads), SAMPLES)
        stamps = np.array(self._stamps, dtype=np.int64)
        self._payloads, self._stamps = [], []
        samples = GaugeSamples(
            found["counter"].astype(np.int64), found["micros"].astype(np.int64), found["counts"].astype(np.int16)
        )
        return samples, stamps
