"""Net F/T raw data transfer (RDT): encoding of requests and records, without input or output.

UDP, port 49152 of the sensor. A request has 8 bytes, a record 36, both big-endian (sourced: netft/pyNetFT,
core/src/detail/protocol.cpp, sequence.cpp and status.cpp).
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pydantic import Field

from tactbench.plugin import ChannelSpec, Quality, StreamSpec
from tactbench.plugin.devices import Options

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

_REQUEST = struct.Struct(">HHI")
_RECORD = struct.Struct(">III6i")
_HEADER = 0x1234
RECORD_BYTES = _RECORD.size
RECORDS = np.dtype([("rdt_sequence", ">u4"), ("ft_sequence", ">u4"), ("status", ">u4"), ("counts", ">i4", (6,))])
"""Structured dtype of a record, with the same fields as `_RECORD`, for arrays."""
SEQUENCE_MODULUS = 1 << 32
SENSOR_RATE_HZ = 7000
"""Sampling rate [Hz]; the box sends every n-th sample (sourced: ATI manual 9620-05-NET FT, section 4.7, as quoted in a
public client)."""
AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
STREAM = "force_torque"


class NetFtOptions(Options):
    """Options of a Net F/T box in a rig file, as set on the box's web page."""

    rate_hz: float = Field(default=1000.0, gt=0.0, le=SENSOR_RATE_HZ)
    """Records sent per second, as set on the box's web page: no request can change this rate."""
    counts_per_newton: float = Field(gt=0.0)
    counts_per_newton_metre: float = Field(gt=0.0)

    @property
    def every(self) -> int:
        """Number of sensor samples from one record to the next."""
        return max(1, int(SENSOR_RATE_HZ // self.rate_hz))

    @property
    def stream(self) -> StreamSpec:
        """Stream of forces [N] and torques [N*m] in the sensor's own axes, at the rate rounded as in the box."""
        channels = [
            ChannelSpec(name=name, kind="force", unit="N") if name.startswith("f")
            else ChannelSpec(name=name, kind="torque", unit="N*m")
            for name in AXES
        ]  # fmt: skip
        return StreamSpec(name=STREAM, rate_hz=SENSOR_RATE_HZ / self.every, channels=tuple(channels))

    def wrench(self, counts: npt.ArrayLike) -> FloatArray:
        """Return (…, 6) Fx, Fy, Fz [N], Tx, Ty, Tz [N*m] for (…, 6) counts of a record."""
        wrench: FloatArray = np.asarray(counts, dtype=float) / self._divisors
        return wrench

    def counts(self, wrench: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Return the (…, 6) nearest counts of a (…, 6) wrench [N, N*m]."""
        return np.rint(np.asarray(wrench, dtype=float) * self._divisors).astype(np.int64)

    @cached_property
    def _divisors(self) -> FloatArray:
        return np.repeat([self.counts_per_newton, self.counts_per_newton_metre], 3)


class Command(IntEnum):
    """Commands of a request; others of the box are not used here."""

    STOP = 0x0000
    START_REALTIME = 0x0002


def encode_request(command: Command, records: int = 0) -> bytes:
    """Return the 8 bytes of a request for `count` records; 0: records until stopped."""
    return _REQUEST.pack(_HEADER, command, records)


def decode_request(data: bytes) -> tuple[Command, int] | None:
    """Return command and number of records in a datagram; None: it is not a request of this protocol."""
    try:
        header, command, count = _REQUEST.unpack(data)
        return (Command(command), count) if header == _HEADER else None
    except (struct.error, ValueError):
        return None


def encode_record(rdt_sequence: int, ft_sequence: int, status: int, counts: Iterable[int]) -> bytes:
    """Return the 36 bytes of a record: record number and sample number, both modulo 2^32, status, and six counts."""
    return _RECORD.pack(rdt_sequence, ft_sequence, status, *counts)


def decode_records(data: bytes) -> npt.NDArray[np.void]:
    """Return the records of one datagram, or of several joined, as an array of dtype :data:`RECORDS`.

    Raises
    ------
    ValueError
        If the data are no whole number of records.
    """
    return np.frombuffer(data, RECORDS)


ERROR_SUMMARY, SATURATION, CONDITION_LATCHED = 0x80000000, 0x00020000, 0x00010000
WARNING = ERROR_SUMMARY | CONDITION_LATCHED
"""Status word after a threshold set in the box was passed; its record is good (sourced: pyNetFT, status.cpp)."""


def quality(status: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint8]:
    """Return for each status word the quality mark of all six channels: saturation apart from other errors.

    Errors are SUSPECT, not MISSING: the box's manual forbids use of the values, yet many status bits (on networks and
    other buses) do not concern the values, and the mark SUSPECT keeps them for the user's decision.
    """
    saturated = (status & SATURATION).astype(bool)
    good = np.isin(status, (0, WARNING)) | ((status | WARNING) == WARNING | SATURATION)
    return np.asarray(saturated * Quality.SATURATED + ~good * Quality.SUSPECT, dtype=np.uint8)
