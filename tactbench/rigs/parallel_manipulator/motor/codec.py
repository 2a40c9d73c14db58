"""Faulhaber ASCII over RS232: encoding of commands and answers, without input or output.

A command is ``NAME[argument]`` and CR; an answer is a line that ends with CR LF and names no command (sourced:
Faulhaber manual MCBL 3564K024B CS, chapter 5, published at manualshive.com). Between a command and its answer the drive
may put notices: single letters on a line of their own. The protocol has no checksum: a digit that becomes another digit
on the line cannot be detected, so that limits, and the position before a move, must be read twice.
The units of the integers are in ``profile.py``.
"""

from __future__ import annotations

import re
from enum import Enum, IntFlag
from typing import NamedTuple

BITS_PER_BYTE = 10
"""Bits on the line for each byte: start bit, 8 data bits, stop bit (8N1) (sourced: the manual, page 13)."""
LONGEST_LINE = 128
"""Number of bytes kept of a line without an end (assumed): above the length of every readable line."""
LONGEST_ANSWER = 34
"""Length of the longest answer in the sources [bytes]: the refusal of a drive that is too hot."""

OK = "OK"
UNKNOWN_COMMAND = "Unknown command"
INVALID_PARAMETER = "Invalid parameter"
NOT_AVAILABLE = "Command not available"
OVERTEMPERATURE = "Overtemperature - drive disabled"
"""Answer of a drive that is too hot. The manual typesets a dash; two public drivers match the hyphen (sourced)."""
TEXTS = ("VER", "GTYP", "GSER")
"""Queries that the drive answers by a text; it answers all others by a number, and commands by ``OK``."""


class Command(NamedTuple):
    """One command as read by the drive."""

    name: str
    """Name in capital letters; empty: not a readable command."""
    argument: int | None = None


def encode(name: str, argument: int | None = None) -> bytes:
    """Return the bytes of a command: letters, for example ``LA``, and a number in the drive's own units."""
    return f"{name}{'' if argument is None else argument}\r".encode("ascii")


_COMMAND = re.compile(r"[0-9]{0,3}([A-Z]{1,20})([+-]?[0-9]{1,19})?", re.ASCII)
"""Pattern of a command. The address before the name, for lines with several drives, is ignored: there is one drive."""


class CommandReader:
    """Conversion of a host's bytes to commands, as in the drive: spaces and case are ignored."""

    def __init__(self) -> None:
        self._line = b""

    def feed(self, data: bytes) -> list[Command]:
        """Return the commands completed by `data`; a command that cannot be read has an empty name."""
        *lines, rest = (self._line + data).split(b"\r")
        self._line = rest[:LONGEST_LINE]
        matches = [_COMMAND.fullmatch(line.decode("latin-1").replace(" ", "").upper()) for line in lines]
        return [Command(match[1], int(match[2]) if match[2] else None) if match else Command("") for match in matches]


class Kind(Enum):
    """Kinds of lines sent by the drive, each with its pattern; a line is of the first kind whose pattern it matches."""

    OK = OK
    VALUE = "[+-]?[0-9]{1,19}"
    """An integer, or a row of 0 and 1 as answer to GST or GFS."""
    REFUSAL = f"{UNKNOWN_COMMAND}|{INVALID_PARAMETER}|{NOT_AVAILABLE}|Overtemperature.+"
    """The character between the words of `OVERTEMPERATURE` differs among sources; the meaning does not."""
    NOTICE = "[pvrfhtwx]"
    """Message sent without a command, never the answer to one: position reached, velocity reached, error (older
    drives), fault, edge at the analog input, inputs 3, 4, 5.

    Sourced: KickdriveOliver/docklight, example Faulhaber_RS232; `r` from the manual of the 3564K024B C, page 52."""
    TEXT = r"[\x20-\x7e]{2,100}"
    """Any other printable text."""
    GARBLED = ""
    """Text that no drive sends: damaged on the line."""


class Line(NamedTuple):
    """One line received from the drive, without CR LF."""

    kind: Kind
    text: str
    t_ns: int = 0
    """Time of receipt of the line's first byte [ns]."""

    def answers(self, query: str) -> bool:
        """Return True if the line may be the answer to a query.

        A late answer to an earlier query of the same kind passes, too, as answers do not name their query.
        """
        return bool(query) and (self.kind is Kind.VALUE or (self.kind is Kind.TEXT and query in TEXTS))


def _read_line(raw: bytes, t_ns: int) -> Line:
    text, end = raw[:-1].decode("latin-1"), raw[-1:]
    kinds = (kind for kind in Kind if end == b"\r" and re.fullmatch(kind.value, text))
    return Line(next(kinds, Kind.GARBLED), text, t_ns)


class LineReader:
    """Conversion of the drive's bytes, cut anywhere, to lines; after damage it recovers at the next LF."""

    def __init__(self) -> None:
        self._line = b""
        self._began_ns = 0

    def feed(self, data: bytes, t_ns: int = 0) -> list[Line]:
        """Return the lines completed by `data`, received at `t_ns`, including notices; raises no error."""
        began_ns = self._began_ns if self._line else t_ns
        *ended, rest = (self._line + data).split(b"\n")
        self._line, self._began_ns = rest[:LONGEST_LINE], t_ns if ended else began_ns
        return [_read_line(raw, t_ns if number else began_ns) for number, raw in enumerate(ended)]

    def clear(self) -> None:
        """Discard an unfinished line, after a time-out or a change of the answer mode."""
        self._line = b""


class OperationStatus(IntFlag):
    """Bits of the answer to OST (sourced: the manual, page 68); others, of programs and more inputs, are left out."""

    CURRENT_LIMITATION = 1 << 4
    DEVIATION_ERROR = 1 << 5
    OVERVOLTAGE = 1 << 6
    OVERTEMPERATURE = 1 << 7
    POSITION_ATTAINED = 1 << 16


class Configuration(IntFlag):
    """Status bits in the answer to the command CST, as a public driver names them; other bits are ignored."""

    ACKNOWLEDGES = 1 << 2
    POWER_STAGE = 1 << 10
    POSITION_LIMITS = 1 << 13


def line_time_s(n_bytes: int, baud: int) -> float:
    """Return the time that `n_bytes` bytes take on the line [s] (derived: 10 bits for each byte)."""
    return n_bytes * BITS_PER_BYTE / baud
