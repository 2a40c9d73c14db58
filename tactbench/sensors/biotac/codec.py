"""Conversion of the BioTac's SPI commands, replies and properties to bytes and back.

Two public sources state the protocol and agree where not stated otherwise: [driver] kth-ros-pkg/biotac_driver,
``biotac.h`` and ``biotac.c`` (SynTouch's own library for the Cheetah adapter), and [manual] the SynTouch BioTac SP
product manual of 26 Oct 2015, which states the same protocol for the BioTac. Never tested with a real sensor.

SPI mode 0, most significant bit first, select active low, 500 kHz to 10 MHz [sourced: both]. The host sends a command
of two bytes, deselects for 50 us, selects again and clocks the reply out. Every byte, except those of properties, is
seven bits and an odd parity bit.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from tactbench.plugin import Quantity, sourced
from tactbench.sensors.biotac.channels import STREAMS

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

NAMES: dict[int, str] = {index: name for name, index in INDEX.items()}
"""Name of the channel for each number in a sampling command."""

STREAMING_INDEX = 16
"""Number that switches a sensor to the streaming of protocol 1.1, which ends only after 5 s without clock [sourced]."""

CHANNELS: tuple[str, ...] = tuple(channel.name for stream in STREAMS for channel in stream.channels)
"""Names of the channels of a BioTac with 19 electrodes, in the order of the spec's streams."""

RESEND = b"\x20\x00"
"""Command to repeat the last two bytes. The driver has 20; the manual prints 50, of even parity, against its own rule,
so 20 is sent [derived]."""

READ, WRITE = 0x61, 0x40
"""First byte of a command that reads or writes a property [sourced: both; writing: manual]."""

ERROR = 0xA5
"""First byte of an error reply [sourced: both]. Its parity is even, so that no valid datum begins with it [derived]."""

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
"""Meanings of the second byte of an error reply [sourced: driver; the manual has 2D, 58 and 52]."""


PROPERTIES: dict[str, tuple[int, int]] = {
    "flex version": (0x10, 2),
    "software version": (0x13, 4),
    "serial number": (0x15, 16),
    "cpu speed": (0x61, 2),
    "sampling frequency": (0x70, 2),
}
"""Property -> code, number of bytes; all are read-only and sent without parity [sourced: manual, table 10; driver]."""


class Fault(StrEnum):
    """Faults that a reply of the sensor may have."""

    PARITY = "parity"
    RESERVED = "reserved bits"
    """The parity is right, but a bit that must be 0 is 1."""
    ERROR = "error reply"
    NOT_CONNECTED = "not connected"
    """The data line was low or high throughout: 00 00 or FF FF, both of wrong parity."""
    NO_REPLY = "no reply"
    """Fewer than two bytes were received."""


class Reply(NamedTuple):
    """Datum and fault of one reply from the sensor, a word of two bytes."""

    value: int | None
    """Count, 0 to 4095, as received: with the faults PARITY and RESERVED some bit is wrong; None without a datum."""
    fault: Fault | None = None


def with_parity(payload: int) -> int:
    """Return the byte of seven bits `payload` and, last, the bit that makes the number of ones odd."""
    return payload << 1 | (payload.bit_count() + 1) % 2


def parity_holds(byte: int) -> bool:
    """Return True if the number of ones in the byte is odd."""
    return byte.bit_count() % 2 == 1


def sampling_command(index: int) -> bytes:
    """Return the two bytes that sample channel `index`: ``1SSSSSSP``, and an ignored byte 00 as in the driver.

    Raises
    ------
    ValueError
        If `index` is outside 0 to 63, or is 16, which is no channel: see :data:`STREAMING_INDEX`.
    """
    if not 0 <= index <= 63 or index == STREAMING_INDEX:
        raise ValueError(f"channel number {index} does not exist; 0 to 63 except {STREAMING_INDEX} is expected")
    return bytes([with_parity(0x40 | index), 0x00])


def property_command(name: str) -> bytes:
    """Return the two bytes that read property `name`; raises KeyError for a name not in :data:`PROPERTIES`."""
    return bytes([READ, PROPERTIES[name][0]])


def encoded(count: int) -> bytes:
    """Return the reply that carries `count`: ``D11..D5 P``, ``D4..D0 0 0 P`` [sourced: driver; manual, figure 15]."""
    return bytes([with_parity(count >> 5), with_parity((count & 31) << 2)])


def decoded(word: bytes) -> Reply:
    """Return the count and fault of a received reply; no bytes raise an error.

    A datum whose first byte changed to A5 on the line is taken for an error reply if 58 follows, and otherwise for
    wrong parity: it has a fault either way.
    """
    if len(word) != 2:
        return Reply(None, Fault.NO_REPLY)
    first, second = word
    if first == ERROR and second in ERRORS:
        return Reply(None, Fault.ERROR)
    if word in (b"\x00\x00", b"\xff\xff"):
        return Reply(None, Fault.NOT_CONNECTED)
    value = (first >> 1) * 32 + (second >> 3)
    if not (parity_holds(first) and parity_holds(second)):
        return Reply(value, Fault.PARITY)
    return Reply(value, Fault.RESERVED if second & 0b110 else None)


def property_text(name: str, raw: bytes) -> str | None:
    """Return flex version, software version or serial number as the maker's tools show it.

    None if the bytes are not a property, as from an absent sensor; bytes beyond the property's length are ignored.
    """
    _, length = PROPERTIES[name]
    raw = raw[:length]
    if len(raw) < length or not all(0x21 <= byte <= 0x7E for byte in raw):
        return None
    text = raw.decode("ascii")
    if name == "flex version":
        return f"{text[0]}.{text[1]}"
    if name == "software version":
        return f"{int(text[:2])}.{text[2:]}" if text.isdecimal() else None
    # Serial number, grouped 2-2-2.1.1-1-2-1-4; a sensor is there if it begins with BT [sourced: driver].
    groups = f"{text[0:2]}-{text[2:4]}-{text[4:6]}.{text[6]}.{text[7]}-{text[8]}-{text[9:11]}-{text[11]}-{text[12:]}"
    return groups if text.startswith("BT") else None
