"""Emulator of a Net F/T box: answers requests with datagrams, without input or output, at times passed in."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from tactbench.plugin.devices import (
    CanFrame,
    DeviceEmulator,
    EmulatorSettings,
    Fault,
    Sent,
    fault_concerns,
    read_options,
)
from tactbench.rigs.parallel_manipulator.net_ft.driver import (
    AXES,
    ERROR_SUMMARY,
    SATURATION,
    SENSOR_RATE_HZ,
    SEQUENCE_MODULUS,
    Command,
    NetFtOptions,
    decode_request,
    encode_record,
)


@dataclass(frozen=True)
class DatagramFault(Fault):
    """A fault of the force sensor or of the network."""

    known: ClassVar[Mapping[str, str]] = {
        "dropped": "a datagram does not arrive",
        "doubled": "a datagram arrives twice",
        "out-of-order": "a datagram arrives after the next one",
        "saturated": "the sensor is at an end of its range",
    }


LARGEST = (25.0, 25.0, 35.0, 0.25, 0.25, 0.25)
"""Ends of the sensor's range [N, N*m]: a Nano17 SI-25-0.25 (sourced: calibration file FT8577)."""


class RdtEmulator(DeviceEmulator):
    """A box with its sensor, which reads fx, fy, fz [N], tx, ty, tz [N*m] of `settings.senses`; others are 0.

    Its `faults` may be changed at any time. Raises UsageError for unknown options or faults.
    """

    def __init__(self, settings: EmulatorSettings) -> None:
        self.options = read_options(NetFtOptions, settings.options, "net-ft")
        self.faults = [DatagramFault.parse(text) for text in settings.faults]
        self._senses = settings.senses
        self._seen: Counter[Fault] = Counter()
        self._now_s = 0.0
        self._next: int | None = None
        """Number of the sensor sample that is sent next; None: the box is not sampling."""
        self._sequence = 1
        self._held: list[Sent] = []
        """Datagrams delayed by a fault until the next one is sent."""

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[Sent]:
        """Process one datagram from the host; return the same as `poll`.

        Time never goes back: a time before the latest counts as the latest.
        """
        sent = self.poll(now_s)
        assert isinstance(piece, bytes)
        if request := decode_request(piece):  # the driver asks for records until it stops the box, not for a number
            # The first sample after the request: no sample is older than its request.
            self._next = None if request[0] is Command.STOP else math.floor(self._now_s * SENSOR_RATE_HZ) + 1
            self._sequence, self._held = 1, []
        return sent

    def poll(self, now_s: float) -> list[Sent]:
        """Advance to `now_s`; return the datagrams due until then, each with its time [s]."""
        self._now_s = max(self._now_s, now_s)
        sent: list[Sent] = []
        while self._next is not None and self._next / SENSOR_RATE_HZ <= self._now_s:
            sent += self._one(self._next)
        return sent

    def next_s(self) -> float:
        """Return the time of the next record [s]; infinite while the box does not send."""
        return math.inf if self._next is None else self._next / SENSOR_RATE_HZ

    def _one(self, sample: int) -> list[Sent]:
        at_s = sample / SENSOR_RATE_HZ
        # Number by number: numpy would take longer for six, and this is done a thousand times a second.
        sensed = self._senses(at_s)
        wrench = [sensed.get(name, 0.0) for name in AXES]
        within = [min(max(value, -end), end) for value, end in zip(wrench, LARGEST, strict=True)]
        saturated = within != wrench or any(one.name == "saturated" and one.active(at_s) for one in self.faults)
        counts = self.options.counts(within).tolist()
        status = SATURATION | ERROR_SUMMARY if saturated else 0
        record = encode_record(self._sequence, (sample + 1) % SEQUENCE_MODULUS, status, counts)
        self._sequence = (self._sequence + 1) % SEQUENCE_MODULUS
        self._next = sample + self.options.every
        return self._on_the_way(record, at_s)

    def _on_the_way(self, datagram: bytes, at_s: float) -> list[Sent]:
        """Return the datagrams that arrive when a datagram is sent, in the order of arrival."""
        dropped, doubled, late = (
            fault_concerns(self.faults, name, at_s, self._seen) for name in ("dropped", "doubled", "out-of-order")
        )
        arrived: list[Sent] = [] if dropped else [(at_s, datagram)] * (1 + doubled)
        if late and not self._held:
            self._held = arrived
            return []
        held, self._held = self._held, []
        return arrived + [(at_s, piece) for _, piece in held]
