"""Net F/T raw data transfer (RDT): requests and records as bytes, without input or output.

UDP, port 49152 of the sensor. A request has 8 bytes, a record 36, both big-endian (sourced: netft/pyNetFT,
core/src/detail/protocol.cpp, sequence.cpp and status.cpp).
"""

from __future__ import annotations

import struct
from enum import Enum, IntEnum, IntFlag
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, model_validator

from tactbench.plugin import Quality, RigError
from tactbench.plugin.devices import Options
from tactbench.rigs.parallel_manipulator.force_torque.ati_xml import (
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
MOST_BUFFERED = 40
"""Records in one datagram of buffered transfer, at most (sourced: ATI manual 9620-05-NET FT, section 7.4, as quoted in
a public client)."""
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
    buffered: bool = False
    """Whether several records come in a datagram: less work at high rates, and later."""

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


def decode_record(data: bytes) -> Record:
    """Return the record in a datagram; raises DatagramError if its length is not 36."""
    if len(data) != RECORD_BYTES:
        raise DatagramError(f"A record has {RECORD_BYTES} bytes, not {len(data)}.")
    rdt, ft, status, *counts = _RECORD.unpack(data)
    return Record(rdt, ft, status, tuple(counts))


def decode_records(data: bytes, *, most: int = 1) -> npt.NDArray[np.void]:
    """Return the records of a datagram, an array of :data:`RECORDS`.

    Parameters
    ----------
    data
        A datagram, or several whole ones joined.
    most
        Records it may hold: 1, :data:`MOST_BUFFERED` for buffered transfer.

    Raises
    ------
    DatagramError
        If it is no such datagram.
    """
    n, rest = divmod(len(data), RECORD_BYTES)
    if rest or not 1 <= n <= most:
        raise DatagramError(f"A datagram has 1 to {most} records of {RECORD_BYTES} bytes, not {len(data)} bytes.")
    return np.frombuffer(data, RECORDS)


class Status(IntFlag):
    """Bits of a record's status word (sourced: pyNetFT, status.cpp); undefined ones are kept."""

    ERROR_SUMMARY = 0x80000000
    CPU_OR_RAM = 0x40000000
    DIGITAL_BOARD = 0x20000000
    ANALOG_BOARD = 0x10000000
    SERIAL_LINK = 0x08000000
    PROGRAM_MEMORY = 0x04000000
    HALTED_CONFIGURATION = 0x02000000
    SETTINGS_VALIDATION = 0x01000000
    CONFIGURATION_DOES_NOT_FIT = 0x00800000
    NETWORK = 0x00400000
    CAN = 0x00200000
    RDT = 0x00100000
    ETHERNET_IP = 0x00080000
    DEVICE_NET = 0x00040000
    SATURATION_OR_CONVERTER = 0x00020000
    CONDITION_LATCHED = 0x00010000
    WATCHDOG_TIMEOUT = 0x00004000
    STACK_CHECK = 0x00002000
    SERIAL_EEPROM = 0x00001000
    SERIAL_FLASH = 0x00000800
    ANALOG_BOARD_WATCHDOG = 0x00000400
    EXCITATION_TOO_HIGH = 0x00000200
    EXCITATION_TOO_LOW = 0x00000100
    ARTIFICIAL_GROUND = 0x00000080
    ANALOG_SUPPLY_TOO_HIGH = 0x00000040
    ANALOG_SUPPLY_TOO_LOW = 0x00000020
    SERIAL_LINK_DATA_UNAVAILABLE = 0x00000010
    REFERENCE_OR_POWER = 0x00000008
    TEMPERATURE = 0x00000004
    HTTP = 0x00000002


class Health(Enum):
    """What a status word means for the values beside it."""

    HEALTHY = "healthy"
    WARNING = "warning"
    """A threshold set in the sensor was passed; the values are good."""
    ERROR = "error"
    """The values must not be used."""


def health(status: int) -> Health:
    """Return what a status word means: 0, exactly 80010000, or anything else (sourced: pyNetFT, status.cpp)."""
    if status == 0:
        return Health.HEALTHY
    return Health.WARNING if status == Status.ERROR_SUMMARY | Status.CONDITION_LATCHED else Health.ERROR


def quality(status: int) -> Quality:
    """Return the mark of all six channels: a saturated sensor is told apart from other errors.

    Errors are SUSPECT, not MISSING: the box forbids the use of the values, yet many of its bits (of the network, of
    other buses) do not touch them, and a mark keeps both facts.
    """
    if health(status) is not Health.ERROR:
        return Quality.GOOD
    known = Status.ERROR_SUMMARY | Status.CONDITION_LATCHED | Status.SATURATION_OR_CONVERTER
    marks = Quality.SATURATED if status & Status.SATURATION_OR_CONVERTER else Quality.GOOD
    return marks | Quality.SUSPECT if status & ~int(known) or not marks else marks


def status_text(status: int) -> str:
    """Return what a status word says, in words."""
    if status == 0:
        return "healthy"
    names = [bit.name.lower().replace("_", " ") for bit in Status if status & bit and bit.name]
    left = status & ~sum(Status)
    return ", ".join([*names, *([f"undefined bits {left:08X}"] if left else [])])


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
    texts: dict[str, str] = {}
    needed = ("prodname", "cfgcpf", "cfgcpt", "scfgfu", "scfgtu")
    for element in elements(data):
        if element.name in needed:
            if element.name in texts:
                raise AtiFileError(f"The tag {element.name} stands twice in the sensor's configuration.")
            texts[element.name] = element.text.strip()
    missing = [name for name in needed if name not in texts]
    if missing:
        raise AtiFileError(f"The sensor's configuration has no {', '.join(missing)}.")
    force_n, torque_nm = unit(FORCE_UNITS, texts["scfgfu"], "force"), unit(TORQUE_UNITS, texts["scfgtu"], "torque")
    try:
        per_force, per_torque = float(texts["cfgcpf"]), float(texts["cfgcpt"])
        return CountScale(
            per_newton=per_force / force_n, per_newton_metre=per_torque / torque_nm, product=texts["prodname"]
        )
    except ValueError as error:
        raise AtiFileError(
            f"Counts per unit are positive numbers, not {texts['cfgcpf']!r} and {texts['cfgcpt']!r}."
        ) from error
