"""The BioTac's words on SPI: commands, replies and properties to bytes and back, and counts to units.

Nothing here reads, writes or waits. Two public sources state the protocol and agree where not said otherwise: [driver]
kth-ros-pkg/biotac_driver, ``biotac.h`` and ``biotac.c`` (SynTouch's own library for the Cheetah adapter), and [manual]
the SynTouch BioTac SP product manual of 26 Oct 2015, which says that the BioTac speaks the same protocol. Tested
against an emulator written from the same sources; it has never met a real sensor.

SPI mode 0, most significant bit first, select active low, 500 kHz to 10 MHz [sourced: both]. The host sends a command
of two bytes, deselects for 50 us, selects again and clocks the reply out. Every byte but a property's is seven bits and
an odd parity.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tactbench.plugin import Quantity, sourced
from tactbench.sensors.biotac.channels import CONVERTER_TOP, STREAMS
from tactbench.sensors.biotac.spec import PARAMETERS

if TYPE_CHECKING:
    import numpy.typing as npt

    from tactbench.plugin import FloatArray

_DRIVER = "kth-ros-pkg/biotac_driver biotac.h"

CLOCK: Quantity = sourced(4400.0, "kHz", f"{_DRIVER}: BT_SPI_BITRATE_KHZ_DEFAULT")
SLOWEST_CLOCK: Quantity = sourced(500.0, "kHz", f"{_DRIVER} and the manual: 0.5-10 MHz")
FASTEST_CLOCK: Quantity = sourced(10_000.0, "kHz", f"{_DRIVER} and the manual: 0.5-10 MHz")
COMMAND_RATE: Quantity = sourced(4400.0, "Hz", f"{_DRIVER}: BT_SAMPLE_RATE_HZ_DEFAULT")
SAMPLING_PAUSE: Quantity = sourced(
    50.0, "us", f"{_DRIVER}: BT_AFTERSAMPLE_DELAY_DEFAULT; the manual, 8.3.1: at least, every select inactive"
)
WORD_PAUSE: Quantity = sourced(10.0, "us", f"{_DRIVER}: BT_INTERWORD_DELAY_DEFAULT; the manual's figure 14 shows 5 us")

INDEX: dict[str, int] = {
    "PAC": 0, "PDC": 1, "TAC": 2, "TDC": 3, "Hall": 15, **{f"E{n}": 16 + n for n in range(1, 25)},
}  # fmt: skip
"""Number of each channel in a sampling command [sourced: driver; Hall on some models, E20 to E24 on the SP: manual]."""

STREAMING_INDEX = 16
"""Switches a sensor to the streaming of protocol 1.1, left only after 5 s without a clock [sourced]: never sent."""

CHANNELS: tuple[str, ...] = tuple(channel.name for stream in STREAMS for channel in stream.channels)
"""The channels of the model with 19 electrodes, in the order of the spec's streams."""

RESEND = b"\x20\x00"
"""Asks for the last two bytes once more. The driver has 20; the manual prints 50, of even parity, against its own
rule, so 20 is sent [derived]."""

READ, WRITE = 0x61, 0x40
"""First byte of a command that reads or writes a property [sourced: both; writing: manual]."""

ERROR = 0xA5
"""First byte of an error reply [sourced: both]. Its parity is even, so none is a valid datum [derived]."""

ERRORS: dict[int, str] = {
    0x45: "parity of the command",
    0x3F: "unknown command",
    0x2E: "insufficient delay",
    0x2D: "insufficient delay after a sampling command",
    0x58: "channel not recognised",
    0x5F: "nothing to resend",
    0x52: "parameter is read-only",
    0x57: "error while writing",
}
"""Second byte of an error reply [sourced: driver; the manual has 2D, 58 and 52]."""


class Property(NamedTuple):
    """A property that can be read: its code and how many bytes the sensor sends."""

    code: int
    length: int


PROPERTIES: dict[str, Property] = {
    "flex version": Property(0x10, 2),
    "software version": Property(0x13, 4),
    "serial number": Property(0x15, 16),
    "cpu speed": Property(0x61, 2),
    "sampling frequency": Property(0x70, 2),
    "sampling pattern": Property(0x73, 88),
}
"""All are read-only and sent without parity [sourced: manual, table 10; driver].

The pattern is two bytes for each of 44 commands [derived from the manual's two bytes per command; the driver states
a length of 44 and never reads it].
"""


class Fault(StrEnum):
    """What can be wrong with one reply."""

    PARITY = "parity"
    RESERVED = "reserved bits"
    """Parity holds, but a bit that is always 0 is not."""
    ERROR = "error reply"
    NOT_CONNECTED = "not connected"
    """The line was held low or high throughout: 00 00 or FF FF, both of bad parity."""
    NO_REPLY = "no reply"
    """Fewer than two bytes came."""


class Reply(NamedTuple):
    """One word from the sensor."""

    value: int | None
    """0 to 4095 as received, wrong by a bit under PARITY and RESERVED; None where no datum came."""
    fault: Fault | None = None
    error: int | None = None
    """Second byte of an error reply, a key of :data:`ERRORS`."""


def with_parity(payload: int) -> int:
    """Return the byte of seven bits `payload` and, last, the bit that makes the number of ones odd."""
    return payload << 1 | (payload.bit_count() + 1) % 2


def parity_holds(byte: int) -> bool:
    """Return whether the number of ones is odd."""
    return byte.bit_count() % 2 == 1


def sampling_command(index: int) -> bytes:
    """Return the two bytes that sample channel `index`: ``1SSSSSSP`` and one that is ignored, 00 as in the driver.

    Raises
    ------
    ValueError
        Outside 0 to 63, or for 16, which is no channel: see :data:`STREAMING_INDEX`.
    """
    if not 0 <= index <= 63 or index == STREAMING_INDEX:
        raise ValueError(f"no channel has the number {index}: 0 to 63 without {STREAMING_INDEX}")
    return bytes([with_parity(0x40 | index), 0x00])


def property_command(name: str) -> bytes:
    """Return the two bytes that read property `name`; raises KeyError for a name not in :data:`PROPERTIES`."""
    return bytes([READ, PROPERTIES[name].code])


def encoded(count: int) -> bytes:
    """Return the reply that carries `count`: ``D11..D5 P``, ``D4..D0 0 0 P`` [sourced: driver; manual, figure 15].

    Raises
    ------
    ValueError
        Outside 0 to 4095.
    """
    if not 0 <= count <= 4095:
        raise ValueError(f"{count} has no word of 12 bits")
    return bytes([with_parity(count >> 5), with_parity((count & 31) << 2)])


def decoded(word: bytes) -> Reply:
    """Return what a reply says; any bytes are read, none raises.

    A datum whose first byte became A5 on the line looks like an error reply if 58 follows, and like bad parity
    otherwise: flagged either way.
    """
    if len(word) != 2:
        return Reply(None, Fault.NO_REPLY)
    first, second = word
    if first == ERROR and second in ERRORS:
        return Reply(None, Fault.ERROR, second)
    if word in (b"\x00\x00", b"\xff\xff"):
        return Reply(None, Fault.NOT_CONNECTED)
    value = (first >> 1) * 32 + (second >> 3)
    if not (parity_holds(first) and parity_holds(second)):
        return Reply(value, Fault.PARITY)
    return Reply(value, Fault.RESERVED if second & 0b110 else None)


def property_text(name: str, raw: bytes) -> str | None:
    """Return a property as the maker's tools show it; None if `raw` is none, as from a sensor that is not there.

    Parameters
    ----------
    name
        A key of :data:`PROPERTIES` other than the sampling frequency, whose byte order no source states.
    raw
        The bytes that were clocked out; what follows the property's length is not looked at.

    Raises
    ------
    KeyError
        For an unknown name.
    ValueError
        For the sampling frequency.
    """
    length = PROPERTIES[name].length
    if name == "sampling frequency":
        raise ValueError("no source states the byte order of the sampling frequency")
    raw = raw[:length]
    if name == "sampling pattern":
        return _pattern_text(raw)
    if len(raw) < length:
        return None
    if name == "cpu speed":
        # Big-endian kHz, shown as MIPS [sourced: driver].
        return None if raw in (b"\x00\x00", b"\xff\xff") else f"{int.from_bytes(raw, 'big') / 1000:.1f} MIPS"
    if not all(0x21 <= byte <= 0x7E for byte in raw):
        return None
    text = raw.decode("ascii")
    if name == "flex version":
        return f"{text[0]}.{text[1]}"
    if name == "software version":
        return f"{int(text[:2])}.{text[2:]}" if text.isdecimal() else None
    # Serial number, grouped 2-2-2.1.1-1-2-1-4; a sensor is there if it begins with BT [sourced: driver].
    groups = f"{text[0:2]}-{text[2:4]}-{text[4:6]}.{text[6]}.{text[7]}-{text[8]}-{text[9:11]}-{text[11]}-{text[12:]}"
    return groups if text.startswith("BT") else None


def _pattern_text(raw: bytes) -> str | None:
    """Return the channels' names: ``1SSSSSSP 01`` for each command, the last ``1SSSSSSP FE`` [sourced: manual]."""
    names = {with_parity(0x40 | index): name for name, index in INDEX.items()}
    found = []
    for place in range(0, len(raw) - 1, 2):
        if raw[place] not in names or raw[place + 1] not in (0x01, 0xFE):
            return None
        found.append(names[raw[place]])
        if raw[place + 1] == 0xFE:
            return " ".join(found)
    return None


def electrode_ohm(count: npt.ArrayLike) -> FloatArray:
    """Return the impedance of an electrode, ``(4095/E - 1) 10 kOhm`` [sourced: manual, section 5]; inf at 0 counts."""
    reading = np.asarray(count, dtype=np.float64)
    ratio = np.divide(CONVERTER_TOP, reading, out=np.full(reading.shape, np.inf), where=reading > 0.0)
    return np.asarray((ratio - 1.0) * PARAMETERS["reference_resistor"].to("ohm"))


def pressure_pa(channel: str, count: npt.ArrayLike, offset_count: float) -> FloatArray:
    """Return PDC or PAC as pressure over that at `offset_count`, the reading untouched; the spec's scale per count.

    Raises
    ------
    KeyError
        For a channel without such a scale.
    """
    return np.asarray(_PA_PER_COUNT[channel] * (np.asarray(count, dtype=np.float64) - offset_count))


def tdc_degc(count: npt.ArrayLike) -> FloatArray:
    """Return TDC as temperature, ``b / ln((p - q x)/x) - 273.15`` with x = TDC/4095 [sourced: manual]; nan at 0.

    q = 30 kOhm/0.6444 and p = 10/3 q assume a full scale of 3.0 V beside the stated 3.3 V, with which 2000 counts would
    be about 3 degC more [derived]: keep the counts, too.
    """
    return np.asarray(PARAMETERS["thermistor_b"].to("K") / _thermistor_log(count) - 273.15)


def tac_as_printed(count: npt.ArrayLike) -> FloatArray:
    """Return the manual's formula for TAC, ``-41.07 / ln((p - q x)/x)``; nan at 0. It is no rate of temperature.

    At mid-scale it gives about -3.3 where the manual states 0 to 1 degC/s, so the spec has no unit for TAC but counts
    [derived]. For comparison with tables made by the maker's formula only.
    """
    return np.asarray(-41.07 / _thermistor_log(count))


def _thermistor_log(count: npt.ArrayLike) -> FloatArray:
    x = np.asarray(count, dtype=np.float64) / CONVERTER_TOP
    x = np.where(x > 0.0, x, np.nan)
    return np.asarray(np.log((PARAMETERS["thermistor_p"].value - PARAMETERS["thermistor_q"].value * x) / x))


_PA_PER_COUNT = {
    channel.name: channel.scale.to("Pa/count")
    for stream in STREAMS
    for channel in stream.channels
    if channel.scale is not None and channel.kind in ("dc_pressure", "ac_pressure")
}


def exchange_s(n_sensors: int = 1, *, clock_hz: float | None = None, word_pause_s: float = 0.0) -> float:
    """Return the seconds from a sampling command's first bit to the last reply's last.

    One command to all sensors at once, the pause, then a word and `word_pause_s` for each [sourced: driver]. It must
    stay below the spacing of commands, 227.3 us.
    """
    word_s = 16.0 / (CLOCK.to("Hz") if clock_hz is None else clock_hz)
    return word_s + SAMPLING_PAUSE.to("s") + n_sensors * (word_s + word_pause_s)
