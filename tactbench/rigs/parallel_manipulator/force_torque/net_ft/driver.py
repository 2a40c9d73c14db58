"""The driver of a Net F/T box: it converts all records received over UDP to blocks, in the order of receipt."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from tactbench.plugin import Block, RigError, StreamSpec
from tactbench.plugin.devices import (
    DatagramLink,
    Driver,
    DriverSettings,
    LinkError,
    LinkTimeout,
    Received,
    Unwrap,
)
from tactbench.rigs.parallel_manipulator.force_torque.net_ft.codec import (
    AXES,
    RECORD_BYTES,
    SENSOR_RATE_HZ,
    SEQUENCE_MODULUS,
    STREAM,
    Command,
    NetFtOptions,
    decode_records,
    encode_request,
    quality,
)

QUIET_S = 0.05
"""Time without data after which a stopped box sends no more [s] (assumed: a network of one cable, a busy host)."""
MOST_SILENCED = 4096
"""Largest number of datagrams dropped while waiting for a box to stop: 4 s at 1 kHz."""
ANSWER_S = 0.5
"""Longest time for an answer, besides the time of its records [s] (assumed: a network of one cable)."""


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

        Raises
        ------
        LinkTimeout
            If the box does not send two successive records.
        RigError
            If the box sends at another rate than the options state, or several records in a datagram.
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
        """Let the box send records, and wait for its first datagram.

        Raises
        ------
        LinkTimeout
            If no datagram comes.
        """
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

        Raises
        ------
        LinkUnplugged
            If the network reports that the port of the box is closed.
        RigError
            If a datagram holds several records.
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
