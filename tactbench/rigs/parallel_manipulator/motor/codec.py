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
"""Number of bytes after which a line without an end is discarded (assumed)."""
LONGEST_ANSWER = 34
"""Length of the longest answer in the sources [bytes]: the refusal of a drive that is too hot."""

OK = "OK"
UNKNOWN_COMMAND = "Unknown command"
INVALID_PARAMETER = "Invalid parameter"
NOT_AVAILABLE = "Command not available"
OVERTEMPERATURE = "Overtemperature - drive disabled"
"""Answer of a drive that is too hot. The manual typesets a dash; two public drivers match the hyphen (sourced)."""
REFUSALS = (UNKNOWN_COMMAND, INVALID_PARAMETER, NOT_AVAILABLE, OVERTEMPERATURE)
NOTICES = "pvrfhtwx"
"""Notices: position reached, velocity reached, error (older drives), fault, edge at the analog input, inputs 3, 4, 5.

Sourced: KickdriveOliver/docklight, example Faulhaber_RS232; `r` from the manual of the 3564K024B C, page 52."""
ACKNOWLEDGED = frozenset(
    ("EN", "DI", "LA", "LR", "M", "V", "HO", "NP", "NPOFF", "SP", "AC", "DEC", "LL", "APL", "LPC", "LCC", "CORRIDOR",
     "ANSW", "SOR")
)  # fmt: skip
"""Commands that the drive answers by ``OK`` (sourced: the manual)."""
TEXTS = ("VER", "GTYP", "GSER")
"""Queries that the drive answers by a text; it answers all others by a number."""


class Command(NamedTuple):
    """One command as read by the drive."""

    name: str
    """Name in capital letters; empty: not a readable command."""
    argument: int | None = None


def encode(name: str, argument: int | None = None) -> bytes:
    """Return the bytes of a command: letters, for example ``LA``, and a number in the drive's own units."""
    return f"{name}{'' if argument is None else argument}\r".encode("ascii")


_COMMAND = re.compile(r"[0-9]{0,3}([A-Z]+)([+-]?[0-9]{1,19})?", re.ASCII)
"""Pattern of a command. The address before the name, for lines with several drives, is ignored: there is one drive."""


class CommandReader:
    """Conversion of a host's bytes to commands, as in the drive: spaces and case are ignored."""

    def __init__(self) -> None:
        self._line = b""

    def feed(self, data: bytes) -> list[Command]:
        """Return the commands completed by `data`; a command that cannot be read has an empty name."""
        found = []
        *lines, rest = (self._line + data).split(b"\r")
        # One byte more than allowed is kept, so that the line cannot be read as a shorter one.
        self._line = rest[: LONGEST_LINE + 1]
        for line in lines:
            match = _COMMAND.fullmatch(line.decode("latin-1").replace(" ", "").upper())
            name, argument = ("", None) if match is None or len(line) > LONGEST_LINE else match.groups()
            found.append(Command(name, int(argument) if argument else None))
        return found


class Kind(Enum):
    """Kinds of lines sent by the drive."""

    OK = "ok"
    VALUE = "value"
    """An integer, or a row of 0 and 1 as answer to GST or GFS."""
    TEXT = "text"
    """Any other printable text."""
    REFUSAL = "refusal"
    NOTICE = "notice"
    """Message sent without a command; never the answer to a command."""
    GARBLED = "garbled"
    """Text that no drive sends: damaged on the line."""


class Line(NamedTuple):
    """One line received from the drive, without CR LF."""

    kind: Kind
    text: str
    t_ns: int = 0
    """Time of receipt of the line's first byte [ns]."""

    def answers(self, name: str) -> bool:
        """Return True if the line may be the answer to a command; a refusal may answer any command.

        A late answer to an earlier command of the same kind passes, too, as answers do not name their command.
        """
        if self.kind is Kind.REFUSAL:
            return True
        if name.upper() in ACKNOWLEDGED:
            return self.kind is Kind.OK
        return self.kind is Kind.VALUE or (self.kind is Kind.TEXT and name.upper() in TEXTS)


_VALUE = re.compile(r"[+-]?[0-9]{1,19}")
_PRINTED = re.compile(r"[\x20-\x7e]+")


def _read_line(raw: bytes, t_ns: int) -> Line:
    text, whole = raw.decode("latin-1").removesuffix("\r"), raw.endswith(b"\r") and len(raw) <= LONGEST_LINE + 1
    if whole and raw.startswith(b"Overtemperature"):
        # The character between the words differs among sources; the meaning does not.
        return Line(Kind.REFUSAL, OVERTEMPERATURE, t_ns)
    if not whole or _PRINTED.fullmatch(text) is None:
        kind = Kind.GARBLED
    elif text == OK:
        kind = Kind.OK
    elif text in REFUSALS:
        kind = Kind.REFUSAL
    elif _VALUE.fullmatch(text):
        kind = Kind.VALUE
    elif len(text) == 1:
        kind = Kind.NOTICE if text in NOTICES else Kind.GARBLED
    else:
        kind = Kind.TEXT
    return Line(kind, text, t_ns)


class LineReader:
    """Conversion of the drive's bytes, cut anywhere, to lines; after damage it recovers at the next LF."""

    def __init__(self) -> None:
        self._line = b""
        self._began_ns = 0

    def feed(self, data: bytes, t_ns: int = 0) -> list[Line]:
        """Return the lines completed by `data`, received at `t_ns`, including notices; raises no error."""
        if not self._line:
            self._began_ns = t_ns
        *ended, rest = (self._line + data).split(b"\n")
        found = [_read_line(raw, t_ns if number else self._began_ns) for number, raw in enumerate(ended)]
        if ended:
            self._began_ns = t_ns
        # One byte more than allowed is kept, so that an overlong line is recognised.
        self._line = rest[: LONGEST_LINE + 2]
        return found

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
