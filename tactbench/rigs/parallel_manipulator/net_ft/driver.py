"""Net F/T raw data transfer (RDT) over UDP: options, encoding of requests and records, and the driver of the box.

The sensor's port is 49152. Requests have 8 bytes, records 36, both big-endian (sourced: netft/pyNetFT,
core/src/detail/protocol.cpp, sequence.cpp and status.cpp).
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import suppress
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pydantic import Field

from tactbench.plugin import Block, ChannelSpec, Quality, RigError, StreamSpec
from tactbench.plugin.devices import (
    DatagramLink,
    Driver,
    DriverSettings,
    LinkError,
    LinkTimeout,
    Options,
    Received,
    Unwrap,
)

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
QUIET_S = 0.05
"""Time without data after which a stopped box sends no more [s] (assumed: a network of one cable, a busy host)."""
MOST_SILENCED = 4096
"""Largest number of datagrams dropped while waiting for a box to stop: 4 s at 1 kHz."""
ANSWER_S = 0.5
"""Longest time for an answer, besides the time of its records [s] (assumed: a network of one cable)."""


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

    Raises ValueError if the data are no whole number of records.
    """
    return np.frombuffer(data, RECORDS)


ERROR_SUMMARY, SATURATION, CONDITION_LATCHED = 0x80000000, 0x00020000, 0x00010000
WARNING = ERROR_SUMMARY | CONDITION_LATCHED
"""Status word after a threshold set in the box was passed; its record is good (sourced: pyNetFT, status.cpp)."""


def quality(status: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint8]:
    """Return for each status word the quality mark of all six channels: SATURATED, SUSPECT for other errors, or both.

    Errors are SUSPECT, not MISSING: the box's manual forbids use of the values, yet many status bits (on networks and
    other buses) do not concern the values, and the mark SUSPECT keeps them for the user's decision.
    """
    saturated = (status & SATURATION).astype(bool)
    good = np.isin(status, (0, WARNING)) | ((status | WARNING) == WARNING | SATURATION)
    return np.asarray(saturated * Quality.SATURATED + ~good * Quality.SUSPECT, dtype=np.uint8)


def _other_length(piece: Received) -> RigError:
    return RigError(
        f"A datagram of {len(piece.data)} bytes was received; one record has {RECORD_BYTES} bytes.",
        hint="Set the RDT buffer size on the box's web page to 1, for one record in each datagram.",
    )


class NetFtDriver(Driver):
    """Driver of a Net F/T box on a datagram link.

    Blocks hold every record in the order of receipt: `sequence` is the record's own number, so that a record received
    twice has the same number, a late record a lower one. `device_ns` is the box's count of samples at 7 kHz, as time: a
    clock as exact as the box's oscillator, running only while it samples. `t_ns` is the time of receipt.

    A saturated sensor marks all six channels SATURATED, any other error of the status word SUSPECT, both
    together both. A passed threshold set in the box is counted as warning, its values are good. `read` of a silent box
    returns no block. After a loss of power, the box counts from 0, and is silent until started.
    """

    device, link_kind, address = "net-ft", DatagramLink, "udp://192.168.1.1:49152"
    options_kind = NetFtOptions
    options: NetFtOptions
    link: DatagramLink

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        self._counts: Counter[str] = Counter()
        self._kept: list[Received] = []
        self._sampling = self._silent = False
        self._numbers, self._ticks = Unwrap(32), Unwrap(32)

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """Stream `force_torque`, at the rate of the options, rounded as in the box."""
        return (self.options.stream,)

    @property
    def counts(self) -> Mapping[str, int]:
        """Counts of ``rejected`` datagrams, and of records with ``errors`` (also saturation) or ``warnings``."""
        return +self._counts

    def identify(self) -> Mapping[str, str]:
        """Read two records; return the box's rate and status as texts.

        Raises LinkTimeout if the box does not send two successive records, and RigError if it sends at another rate
        than the options state, or several records in a datagram.
        """
        self._silence()
        self.link.send(encode_request(Command.START_REALTIME))
        first, second = (decode_records(self._next().data)[0] for _ in range(2))
        self._silence()
        every = (int(second["ft_sequence"]) - int(first["ft_sequence"])) % SEQUENCE_MODULUS
        if every != self.options.every:
            raise RigError(
                f"The box sends every {every}th of its {SENSOR_RATE_HZ} samples a second, the rig file expects every "
                f"{self.options.every}th (rate_hz: {self.options.rate_hz:g}).",
                hint=f"Set the RDT rate on the box's web page, or write rate_hz: {SENSOR_RATE_HZ / max(every, 1):.6g}.",
            )
        return {"rate_hz": f"{SENSOR_RATE_HZ / every:.6g}", "status": f"{int(second['status']):08X}"}

    def start(self) -> None:
        """Let the box send records, and wait for its first datagram; raises LinkTimeout if no datagram comes."""
        if not self._silent:  # the other devices of a rig sample already, and would wait
            self._silence()
        self._silent = False
        self.link.discard()
        self._numbers, self._ticks = Unwrap(32), Unwrap(32)
        self.link.send(encode_request(Command.START_REALTIME))
        self._sampling = True
        self._kept = [self._next()]

    def read(self, timeout_s: float) -> list[Block]:
        """Return the records received since the last call.

        Raises LinkUnplugged if the network reports that the box's port is closed, and RigError if a datagram holds
        several records.
        """
        received, self._kept = self._kept, []
        received += self.link.receive_all(0.0 if received else timeout_s)
        records = [piece for piece in received if len(piece.data) == RECORD_BYTES]
        for piece in received:
            if len(piece.data) > RECORD_BYTES and len(piece.data) % RECORD_BYTES == 0:
                raise _other_length(piece)
        self._counts["rejected"] += len(received) - len(records)
        return [self._block(records)] if records else []

    def stop(self) -> None:
        """Stop the box from sending, and wait until it is silent."""
        if self._sampling:
            self._sampling, self._kept = False, []
            with suppress(LinkError):
                self._silence()

    def _silence(self) -> None:
        """Stop the box, and drop its earlier records, which would otherwise seem to belong to the next start."""
        self.link.send(encode_request(Command.STOP))
        with suppress(LinkTimeout):
            for _ in range(MOST_SILENCED):
                self.link.receive(QUIET_S + 2 * self.options.every / SENSOR_RATE_HZ)
        self._silent = True

    def _next(self) -> Received:
        """Return the next record; raises LinkTimeout if no record comes, and RigError for a wrong length."""
        piece: Received = self.link.receive(ANSWER_S + 2 * self.options.every / SENSOR_RATE_HZ)
        if len(piece.data) != RECORD_BYTES:
            raise _other_length(piece)
        return piece

    def _block(self, received: list[Received]) -> Block:
        records = decode_records(b"".join(piece.data for piece in received))
        ticks, numbers = self._ticks(records["ft_sequence"]), self._numbers(records["rdt_sequence"])
        status = records["status"]
        marks = quality(status)
        self._counts["errors"] += int((marks != 0).sum())
        self._counts["warnings"] += int(((status != 0) & (marks == 0)).sum())
        return Block(
            stream=STREAM,
            t_ns=np.array([piece.t_ns for piece in received], dtype=np.int64),
            data=self.options.wrench(records["counts"]),
            quality=np.repeat(marks[:, None], len(AXES), axis=1) if status.any() else None,
            sequence=numbers,
            # 10^9 / 7000 in whole numbers.
            device_ns=ticks * 1_000_000 // 7,
        )
