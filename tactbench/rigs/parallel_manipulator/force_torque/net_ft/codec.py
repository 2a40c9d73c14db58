"""Net F/T raw data transfer (RDT): requests and records as bytes, without input or output.

UDP, port 49152 of the sensor. A request has 8 bytes, a record 36, both big-endian (sourced: netft/pyNetFT,
core/src/detail/protocol.cpp, sequence.cpp and status.cpp).
"""

from __future__ import annotations

import struct
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, model_validator

from tactbench.plugin import Quality, RigError
from tactbench.plugin.devices import Options
from tactbench.rigs.parallel_manipulator.force_torque.ati import (
    FORCE_UNITS,
    TORQUE_UNITS,
    AtiFileError,
    elements,
    unit,
)

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

PORT = 49152
CONFIGURATION_PATH = "/netftapi2.xml"
"""What HTTP GET asks the sensor for: counts per unit, and the units."""

_REQUEST = struct.Struct(">HHI")
_RECORD = struct.Struct(">III6i")
_HEADER = 0x1234
RECORD_BYTES = _RECORD.size
RECORDS = np.dtype([("rdt_sequence", ">u4"), ("ft_sequence", ">u4"), ("status", ">u4"), ("counts", ">i4", (6,))])
"""The same as `_RECORD`, for many at once."""
SEQUENCE_MODULUS = 1 << 32
LEAST_COUNT, GREATEST_COUNT = -(2**31), 2**31 - 1
"""Of the signed 32 bits of a record."""
SENSOR_RATE_HZ = 7000
"""The box samples at 7 kHz and sends every n-th sample (sourced: ATI manual 9620-05-NET FT, section 4.7, as quoted in a
public client)."""


class NetFtOptions(Options):
    """What a rig file says of a box."""

    rate_hz: float = Field(default=1000.0, gt=0.0, le=SENSOR_RATE_HZ)
    """Records a second that the box is set to send; its own web page sets them, no request does."""
    counts_per_newton: float | None = Field(default=None, gt=0.0)
    counts_per_newton_metre: float | None = Field(default=None, gt=0.0)
    configuration: str = ""
    """In place of the counts: ``http`` asks the box that the link goes to, ``http://…`` another address; anything else
    is a file that holds the box's ``netftapi2.xml``."""
    bias: bool = False
    """Whether starting takes the present reading as zero: the sensor must be unloaded then."""

    @model_validator(mode="after")
    def _one_scale(self) -> NetFtOptions:
        counts = [self.counts_per_newton, self.counts_per_newton_metre]
        if (None in counts) if not self.configuration else (counts != [None, None]):
            raise ValueError(
                "give counts_per_newton and counts_per_newton_metre, or else configuration: http or a file; the box's "
                "web page shows them"
            )
        return self

    @property
    def every(self) -> int:
        """Samples of the sensor from one record to the next."""
        return max(1, int(SENSOR_RATE_HZ // self.rate_hz))

    def scale(self, configuration: bytes) -> CountScale:
        """Return counts per unit; `configuration` is what the file or the box says, if one is asked for."""
        if self.counts_per_newton is None or self.counts_per_newton_metre is None:
            return read_configuration(configuration)
        return CountScale(per_newton=self.counts_per_newton, per_newton_metre=self.counts_per_newton_metre)


class DatagramError(RigError, ValueError):
    """A datagram is not one of this protocol."""


class Command(IntEnum):
    """What a request asks for."""

    STOP = 0x0000
    START_REALTIME = 0x0002
    START_BUFFERED = 0x0003
    RESET_CONDITION_LATCH = 0x0041
    SET_SOFTWARE_BIAS = 0x0042


class Request(NamedTuple):
    """One request."""

    command: Command
    records: int = 0
    """How many are wanted; 0: until stopped."""


class Record(NamedTuple):
    """One record."""

    rdt_sequence: int
    """Counts records sent, modulo 2^32."""
    ft_sequence: int
    """Counts the sensor's own samples, modulo 2^32."""
    status: int
    counts: tuple[int, int, int, int, int, int]
    """Fx, Fy, Fz, Tx, Ty, Tz."""


def encode_request(request: Request) -> bytes:
    """Return the 8 bytes of a request; raises ValueError for a count that 32 bits do not hold."""
    if not 0 <= request.records < SEQUENCE_MODULUS:
        raise ValueError(f"a count is 0 to 2^32 - 1, not {request.records}")
    return _REQUEST.pack(_HEADER, request.command, request.records)


def decode_request(data: bytes) -> Request:
    """Return the request in a datagram; raises DatagramError if there is none."""
    if len(data) != _REQUEST.size:
        raise DatagramError(f"A request has {_REQUEST.size} bytes, not {len(data)}.")
    header, command, count = _REQUEST.unpack(data)
    if header != _HEADER:
        raise DatagramError(f"A request begins with {_HEADER:04X}, not {header:04X}.")
    try:
        return Request(Command(command), count)
    except ValueError:
        raise DatagramError(f"There is no command {command:04X}.") from None


def encode_record(record: Record) -> bytes:
    """Return the 36 bytes of a record; raises ValueError for numbers that 32 bits do not hold."""
    try:
        return _RECORD.pack(record.rdt_sequence, record.ft_sequence, record.status, *record.counts)
    except struct.error as error:
        raise ValueError(f"{record} does not fit its 32-bit fields: {error}") from error


def decode_records(data: bytes) -> npt.NDArray[np.void]:
    """Return the records of a datagram, or of several joined, an array of :data:`RECORDS`.

    Raises
    ------
    DatagramError
        If it is not one or more whole records.
    """
    if not data or len(data) % RECORD_BYTES:
        raise DatagramError(f"Records of {RECORD_BYTES} bytes were expected, not {len(data)} bytes.")
    return np.frombuffer(data, RECORDS)


STATUS_BITS = (
    "error summary", "CPU or RAM", "digital board", "analog board", "serial link", "program memory",
    "halted configuration", "settings validation", "configuration does not fit", "network", "CAN", "RDT", "EtherNet/IP",
    "DeviceNet", "saturation or converter", "condition latched", "", "watchdog timeout", "stack check", "serial EEPROM",
    "serial flash", "analog board watchdog", "excitation too high", "excitation too low", "artificial ground",
    "analog supply too high", "analog supply too low", "serial link data unavailable", "reference or power",
    "temperature", "HTTP", "",
)  # fmt: skip
"""Of a record's status word, from the highest bit down (sourced: pyNetFT, status.cpp); empty: undefined."""
ERROR_SUMMARY, SATURATION, CONDITION_LATCHED = 0x80000000, 0x00020000, 0x00010000
WARNING = ERROR_SUMMARY | CONDITION_LATCHED
"""A threshold set in the sensor was passed: exactly this; its values are good (sourced: pyNetFT, status.cpp)."""


def quality(status: int) -> Quality:
    """Return the mark of all six channels: a saturated sensor is told apart from other errors.

    Errors are SUSPECT, not MISSING: the box forbids the use of the values, yet many of its bits (of the network, of
    other buses) do not touch them, and a mark keeps both facts.
    """
    if status in (0, WARNING):
        return Quality.GOOD
    marks = Quality.SATURATED if status & SATURATION else Quality.GOOD
    return marks | Quality.SUSPECT if status & ~(WARNING | SATURATION) or not marks else marks


def status_text(status: int) -> str:
    """Return what a status word says, in words."""
    bits = [(name, 1 << (31 - place)) for place, name in enumerate(STATUS_BITS) if status >> (31 - place) & 1]
    names = [name for name, _ in bits if name]
    undefined = sum(bit for name, bit in bits if not name)
    return ", ".join([*names, *([f"undefined bits {undefined:08X}"] if undefined else [])]) or "healthy"


class CountScale(BaseModel):
    """Counts per unit, as the sensor's configuration states them."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    per_newton: float = Field(gt=0.0, allow_inf_nan=False)
    per_newton_metre: float = Field(gt=0.0, allow_inf_nan=False)
    product: str = ""

    def wrench(self, counts: npt.ArrayLike) -> FloatArray:
        """Return (…, 6) Fx, Fy, Fz [N], Tx, Ty, Tz [N*m] of (…, 6) counts."""
        wrench: FloatArray = np.asarray(counts, dtype=float) / self._divisors
        return wrench

    def counts(self, wrench: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Return the (…, 6) nearest counts of a (…, 6) wrench [N, N*m], within the 32 bits of a record."""
        counts = np.rint(np.asarray(wrench, dtype=float) * self._divisors)
        # np.clip would take ten times as long for six.
        return np.minimum(np.maximum(counts, LEAST_COUNT), GREATEST_COUNT).astype(np.int64)

    @cached_property
    def _divisors(self) -> FloatArray:
        return np.repeat([self.per_newton, self.per_newton_metre], 3)


def read_configuration(data: bytes) -> CountScale:
    """Return the scale in the sensor's ``netftapi2.xml``.

    Raises
    ------
    AtiFileError
        If `data` is no such file, if a tag that is needed is not there exactly once, or for an unknown unit.
    """
    needed = ("prodname", "cfgcpf", "cfgcpt", "scfgfu", "scfgtu")
    found = [(element.tag, (element.text or "").strip()) for element in elements(data) if element.tag in needed]
    if sorted(tag for tag, _ in found) != sorted(needed):
        raise AtiFileError(f"The sensor's configuration needs {', '.join(needed)} once each.")
    texts = dict(found)
    force_n, torque_nm = unit(FORCE_UNITS, texts["scfgfu"], "force"), unit(TORQUE_UNITS, texts["scfgtu"], "torque")
    try:
        return CountScale(
            per_newton=float(texts["cfgcpf"]) / force_n,
            per_newton_metre=float(texts["cfgcpt"]) / torque_nm,
            product=texts["prodname"],
        )
    except ValueError as error:
        raise AtiFileError(
            f"Counts per unit are positive numbers, not {texts['cfgcpf']!r} and {texts['cfgcpt']!r}."
        ) from error
