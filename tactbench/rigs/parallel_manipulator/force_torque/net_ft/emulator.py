"""A Net F/T box as a model without input or output: requests in, datagrams out, on a clock that is passed in.

A :class:`tactbench.plugin.devices.DeviceEmulator`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar
from xml.sax.saxutils import escape

from tactbench.plugin import UsageError
from tactbench.plugin.devices import (
    CanFrame,
    DeviceEmulator,
    EmulatorSettings,
    Fault,
    Sent,
    fault_concerns,
    read_file,
    read_options,
)
from tactbench.rigs.parallel_manipulator.force_torque.net_ft.codec import (
    ERROR_SUMMARY,
    GREATEST_COUNT,
    LEAST_COUNT,
    SATURATION,
    SENSOR_RATE_HZ,
    SEQUENCE_MODULUS,
    Command,
    CountScale,
    DatagramError,
    NetFtOptions,
    Record,
    Request,
    decode_request,
    encode_record,
)
from tactbench.rigs.parallel_manipulator.force_torque.wrench import AXES, wrench_of


@dataclass(frozen=True)
class DatagramFault(Fault):
    """A fault of the sensor, or of the way its datagrams take."""

    known: ClassVar[Mapping[str, str]] = {
        "dropped": "a datagram does not arrive",
        "doubled": "a datagram arrives twice",
        "out-of-order": "a datagram arrives after the next one",
        "saturated": "the sensor is at an end of its range",
    }


class RdtEmulator(DeviceEmulator):
    """A box and its sensor.

    Parameters
    ----------
    wrench
        Fx, Fy, Fz [N], Tx, Ty, Tz [N*m] at a time [s].
    scale
        Counts per unit; the default is usual (sourced: pyNetFT).
    rate_hz
        Records a second; the box takes the next rate above that divides 7000.
    largest
        (6,) where the sensor saturates [N, N*m]; the default is that of a Nano17 SI-25-0.25 (sourced: calibration file
        FT8577, quoted in a public script).
    first_sequence
        Of records and samples, to begin near the wrap of the counters.
    faults
        What is wrong with it; may be changed at any time.
    """

    def __init__(
        self,
        wrench: Callable[[float], Sequence[float]],
        *,
        scale: CountScale | None = None,
        rate_hz: float = 1000.0,
        largest: Sequence[float] = (25.0, 25.0, 35.0, 0.25, 0.25, 0.25),
        first_sequence: int = 1,
        faults: Iterable[DatagramFault] = (),
    ) -> None:
        if not 0.0 < rate_hz <= SENSOR_RATE_HZ:
            raise UsageError(f"A Net F/T box sends up to {SENSOR_RATE_HZ} records a second, not {rate_hz:g}.")
        self.scale = scale or CountScale(per_newton=1e6, per_newton_metre=1e6, product="EMULATED Net F/T")
        self.every = max(1, int(SENSOR_RATE_HZ // rate_hz))
        """Samples of the sensor from one record to the next."""
        self.rejected = 0
        """Datagrams that were no request."""
        self._wrench = wrench
        self._largest = tuple(largest)
        self._first_sequence = first_sequence
        self.faults = list(faults)
        self._seen: Counter[Fault] = Counter()
        self._bias = [0] * len(AXES)
        self._now_s = 0.0
        self._next: int | None = None
        self._left: int | None = None
        self._sequence = first_sequence
        self._held: bytes | None = None

    @property
    def rate_hz(self) -> float:
        """Records a second as the box sends them."""
        return SENSOR_RATE_HZ / self.every

    def configuration(self) -> bytes:
        """Return what the box answers to a GET of ``/netftapi2.xml``."""
        return (
            '<?xml version="1.0" encoding="UTF-8"?>\n<netft>'
            f"<prodname>{escape(self.scale.product)}</prodname>"
            f"<cfgcpf>{self.scale.per_newton!r}</cfgcpf><cfgcpt>{self.scale.per_newton_metre!r}</cfgcpt>"
            "<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu></netft>\n"
        ).encode()

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[Sent]:
        """Take one datagram of the host; return what `poll` returns.

        Times do not go back: an earlier one counts as the latest seen.
        """
        sent = self.poll(now_s)
        assert isinstance(piece, bytes)
        try:
            request = decode_request(piece)
        except DatagramError:
            self.rejected += 1
            return sent
        return sent + self._carry_out(request)

    def poll(self, now_s: float) -> list[Sent]:
        """Go on to `now_s`; return the datagrams that are due by then, each with its time."""
        self._now_s = max(self._now_s, now_s)
        sent: list[Sent] = []
        while self._next is not None and self._next / SENSOR_RATE_HZ <= self._now_s:
            sent += self._one(self._next)
        return sent

    def next_s(self) -> float:
        """Return when the next record is due; infinite while nothing is being sent."""
        return math.inf if self._next is None else self._next / SENSOR_RATE_HZ

    def _carry_out(self, request: Request) -> list[Sent]:
        match request.command:
            case Command.START_REALTIME:
                ended = self._ended(self._now_s)
                self._left = request.records or None
                self._sequence = self._first_sequence
                # The first sample after the request: a sample is not older than what asks for it.
                self._next = math.floor(self._now_s * SENSOR_RATE_HZ) + 1
                return ended
            case Command.STOP:
                return self._ended(self._now_s)
            case Command.SET_SOFTWARE_BIAS:
                self._bias = self.scale.counts(self._sensed(self._now_s)[0]).tolist()
        return []

    def _sensed(self, at_s: float) -> tuple[list[float], bool]:
        """Return what the sensor can read of the wrench, and whether it is at an end of its range."""
        # Number by number: numpy would take longer for six, and this is done a thousand times a second.
        wrench = list(zip(self._wrench(at_s), self._largest, strict=True))
        beyond = any(abs(value) >= end for value, end in wrench) or any(
            fault.name == "saturated" and fault.active(at_s) for fault in self.faults
        )
        return [min(max(value, -end), end) for value, end in wrench], beyond

    def _one(self, sample: int) -> list[Sent]:
        at_s = sample / SENSOR_RATE_HZ
        wrench, saturated = self._sensed(at_s)
        fx, fy, fz, tx, ty, tz = (
            min(max(count - zero, LEAST_COUNT), GREATEST_COUNT)
            for count, zero in zip(self.scale.counts(wrench).tolist(), self._bias, strict=True)
        )
        record = Record(
            self._sequence,
            (sample + self._first_sequence) % SEQUENCE_MODULUS,
            SATURATION | ERROR_SUMMARY if saturated else 0,
            (fx, fy, fz, tx, ty, tz),
        )
        self._sequence = (self._sequence + 1) % SEQUENCE_MODULUS
        self._next = sample + self.every
        sent = self._on_the_way(encode_record(record), at_s)
        if self._left is not None:
            self._left -= 1
            if self._left == 0:
                sent += self._ended(at_s)
        return sent

    def _ended(self, at_s: float) -> list[Sent]:
        """Stop sending; return what is still under way."""
        self._next = None
        return self._released(at_s)

    def _released(self, at_s: float) -> list[Sent]:
        held, self._held = self._held, None
        return [] if held is None else [(at_s, held)]

    def _on_the_way(self, datagram: bytes, at_s: float) -> list[Sent]:
        """Return what arrives of a datagram sent at a time, in the order of arrival."""
        dropped, doubled, late = (
            fault_concerns(self.faults, name, at_s, self._seen) for name in ("dropped", "doubled", "out-of-order")
        )
        if dropped:
            return []
        if late and self._held is None:
            self._held = datagram
            return [(at_s, datagram)] * doubled
        return [(at_s, datagram)] * (1 + doubled) + self._released(at_s)


def build(settings: EmulatorSettings) -> RdtEmulator:
    """Return an emulated box that reads `settings.senses`: fx, fy, fz [N], tx, ty, tz [N*m].

    Raises
    ------
    UsageError
        For options or faults that are not known, or if the box is to be asked by HTTP.
    """
    options = read_options(NetFtOptions, settings.options, "net-ft")
    if options.configuration.startswith("http"):
        raise UsageError(
            "An emulated net-ft has no web page.",
            hint="Give counts_per_newton and counts_per_newton_metre, or a file.",
        )
    configuration = read_file(options.configuration, "The box's configuration") if options.configuration else b""
    return RdtEmulator(
        lambda at_s: wrench_of(settings.senses(at_s)),
        scale=options.scale(configuration),
        rate_hz=options.rate_hz,
        faults=[DatagramFault.parse(text) for text in settings.faults],
    )
