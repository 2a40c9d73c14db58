"""Faulhaber ASCII over RS232: commands and answers as bytes, without input or output.

A command is ``[node]NAME[argument]`` and CR; an answer is a line that ends with CR LF and names no node (sourced:
Faulhaber manual MCBL 3564K024B CS, chapter 5, published at manualshive.com). Between a command and its answer the drive
may put notices: single letters on a line of their own. The protocol has no checksum: a digit that becomes another digit
on the line is not noticed by anybody, so what matters (limits, position before a move) must be read twice.
What the integers mean is in ``profile.py``.
"""

from __future__ import annotations

import re
from enum import Enum, IntFlag
from typing import NamedTuple

from tactbench.plugin.devices import Received

BITS_PER_BYTE = 10
"""Start bit, 8 data bits, stop bit: 8N1 (sourced: the manual, page 13)."""
BAUDS = (600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
"""Selectable rates: from 600 to 115200 (sourced: the manual); the steps between are the usual ones (assumed)."""

LONGEST_LINE = 128
"""Bytes after which a line without an end is given up (assumed)."""

LONGEST_ANSWER = 34
"""Bytes of the longest answer in the sources, the refusal of a drive that is too hot."""

OK = "OK"
UNKNOWN_COMMAND = "Unknown command"
INVALID_PARAMETER = "Invalid parameter"
NOT_AVAILABLE = "Command not available"
OVERTEMPERATURE = "Overtemperature - drive disabled"
"""The manual typesets a dash; two public drivers match the hyphen (sourced)."""
SAVED = "EEPROM writing done"
FLASH_DEFECT = "Flash defect"
REFUSALS = (UNKNOWN_COMMAND, INVALID_PARAMETER, NOT_AVAILABLE, OVERTEMPERATURE, FLASH_DEFECT)

NOTICES = "pvrfhtwx"
"""Position reached, velocity reached, error (older drives), fault, edge at the analog input, inputs 3, 4 and 5.

Sourced: KickdriveOliver/docklight, example Faulhaber_RS232; `r` from the manual of the 3564K024B C, page 52."""

_QUERIES = """
    POS TPOS GV GN GRC GCL GU GRU TEM VER GTYP GSER OST SWS CST GST GFS GAST GPL GNL GSP GAC GDEC GPC GCC GCORRIDOR
    GSR GPOR GI GPP GPD GCI GDEV
"""
QUERIES = frozenset(_QUERIES.split())
"""Commands answered by a value and nothing else (sourced: the manual; docklight; a public driver of three drives)."""


class Command(NamedTuple):
    """One command as the drive reads it."""

    name: str
    """Capital letters; empty: no command at all."""
    argument: int | None = None
    node: int | None = None
    """1 to 255; None: for every drive on the line."""


def encode(name: str, argument: int | None = None, *, node: int | None = None) -> bytes:
    """Return the bytes of a command.

    Parameters
    ----------
    name
        Letters, for example ``LA``.
    argument
        In the drive's own units.
    node
        Address on a line with several drives, 1 to 255.

    Raises
    ------
    ValueError
        If `name` has anything but ASCII letters, or `node` is out of range.
    """
    if not (name.isascii() and name.isalpha()):
        raise ValueError(f"a command's name has letters only, not {name!r}")
    if node is not None and not 1 <= node <= 255:
        raise ValueError(f"a node is 1 to 255, not {node}")
    return f"{'' if node is None else node}{name}{'' if argument is None else argument}\r".encode("ascii")


_COMMAND = re.compile(r"([0-9]{1,3})?([A-Z]+)([+-]?[0-9]{1,19})?", re.ASCII)


class CommandReader:
    """Bytes of a host into commands, as the drive reads them: spaces and case do not count."""

    def __init__(self) -> None:
        self._line = bytearray()

    def feed(self, data: bytes) -> list[Command]:
        """Return the commands that `data` completes; one that cannot be read has an empty name."""
        found = []
        for byte in data:
            if byte != 0x0D:
                # One byte more than allowed is kept, so that the line cannot be read as a shorter one.
                if len(self._line) <= LONGEST_LINE:
                    self._line.append(byte)
                continue
            text = self._line.decode("latin-1").replace(" ", "").upper()
            overlong = len(self._line) > LONGEST_LINE
            self._line.clear()
            match = None if overlong else _COMMAND.fullmatch(text)
            if match is None:
                found.append(Command(""))
                continue
            node, name, argument = match.groups()
            found.append(Command(name, int(argument) if argument else None, int(node) if node else None))
        return found


class Kind(Enum):
    """What a line from the drive is."""

    OK = "ok"
    VALUE = "value"
    """An integer, or the 0s and 1s of GST and GFS."""
    TEXT = "text"
    """Anything else that can be printed: VER, GTYP, GSER, and what SAVE answers."""
    REFUSAL = "refusal"
    NOTICE = "notice"
    """Sent by the drive itself; never the answer to a command."""
    GARBLED = "garbled"
    """Not a line that a drive sends."""


class Line(NamedTuple):
    """One line from the drive, without CR LF."""

    kind: Kind
    text: str

    @property
    def value(self) -> int:
        """The integer of a line of kind VALUE; raises ValueError for others."""
        if self.kind is not Kind.VALUE:
            raise ValueError(f"{self.text!r} is no value")
        return int(self.text)


_VALUE = re.compile(rb"[+-]?[0-9]{1,19}")
_PRINTED = re.compile(rb"[\x20-\x7e]+")


def read_line(raw: bytes) -> Line:
    """Return what one line is; `raw` is without its CR LF. Raises nothing."""
    text = raw.decode("latin-1")
    if raw.startswith(b"Overtemperature"):
        # The character between the words differs among sources; the meaning does not.
        return Line(Kind.REFUSAL, OVERTEMPERATURE)
    if _PRINTED.fullmatch(raw) is None:
        return Line(Kind.GARBLED, text)
    if text == OK:
        return Line(Kind.OK, text)
    if text in REFUSALS:
        return Line(Kind.REFUSAL, text)
    if _VALUE.fullmatch(raw):
        return Line(Kind.VALUE, text)
    if len(raw) == 1:
        return Line(Kind.NOTICE if text in NOTICES else Kind.GARBLED, text)
    return Line(Kind.TEXT, text)


class LineReader:
    """Bytes from the drive into lines; cut anywhere, and in step again after the next LF."""

    def __init__(self) -> None:
        self._line = bytearray()
        self._began_ns = 0

    def stamped(self, received: Received) -> list[tuple[Line, int]]:
        """Return the lines that `received` completes, each with when its first byte was in the host [ns]."""
        if not self._line:
            self._began_ns = received.t_ns
        found = []
        for line in self.feed(received.data):
            found.append((line, self._began_ns))
            self._began_ns = received.t_ns
        if b"\n" in received.data:
            self._began_ns = received.t_ns
        return found

    def feed(self, data: bytes) -> list[Line]:
        """Return the lines that `data` completes, notices among them; raises nothing."""
        found = []
        for byte in data:
            if byte != 0x0A:
                # One byte more than allowed is kept, so that an overlong line is known as such.
                if len(self._line) <= LONGEST_LINE + 1:
                    self._line.append(byte)
                continue
            raw = bytes(self._line)
            self._line.clear()
            whole = raw.endswith(b"\r") and len(raw) <= LONGEST_LINE + 1
            found.append(read_line(raw[:-1]) if whole else Line(Kind.GARBLED, raw.decode("latin-1")))
        return found

    def clear(self) -> None:
        """Forget an unfinished line: after a time-out, or a change of rate or answer mode."""
        self._line.clear()


def answers(line: Line, name: str) -> bool:
    """Return whether `line` may be the answer to command `name` under ANSW2; a refusal answers any command.

    A late answer to an earlier command of the same kind passes: answers name neither node nor command.
    """
    if line.kind is Kind.REFUSAL:
        return True
    name = name.upper()
    if name in ("VER", "GTYP", "GSER"):
        return line.kind in (Kind.TEXT, Kind.VALUE)
    if name in QUERIES:
        return line.kind is Kind.VALUE
    if name in ("SAVE", "EEPSAV"):
        return line == Line(Kind.TEXT, SAVED)
    return line.kind is Kind.OK


class OperationStatus(IntFlag):
    """The integer that OST answers (sourced: the manual, page 68)."""

    HOMING = 1 << 0
    PROGRAM_RUNNING = 1 << 1
    STOPPED_BY_DELAY = 1 << 2
    STOPPED_BY_NOTIFY = 1 << 3
    CURRENT_LIMITATION = 1 << 4
    DEVIATION_ERROR = 1 << 5
    OVERVOLTAGE = 1 << 6
    OVERTEMPERATURE = 1 << 7
    INPUT_1 = 1 << 8
    INPUT_2 = 1 << 9
    INPUT_3 = 1 << 10
    INPUT_4 = 1 << 11
    INPUT_5 = 1 << 12
    POSITION_ATTAINED = 1 << 16


class Configuration(IntFlag):
    """Bits of CST that a public driver names (sourced); the others mean nothing here."""

    ACKNOWLEDGES = 1 << 2
    POWER_STAGE = 1 << 10
    POSITION_LIMITS = 1 << 13


def line_time_s(n_bytes: int, baud: int) -> float:
    """Return the seconds that `n_bytes` take on the line (derived: 10 bits a byte)."""
    return n_bytes * BITS_PER_BYTE / baud


def newer_generation(data: bytes) -> bool:
    """Return whether `data` begins with a frame of the newer, binary Faulhaber drives, which this codec cannot speak.

    Such a frame is ``53 length node command data… crc 45``, length the number of bytes but two; the crc goes over all
    bytes from the length to the last datum, shifts right, starts with FF and has the polynomial D5 (sourced:
    tonygoldman/faulhaber-rs232, MsgHandler.cpp).
    """
    if len(data) < 2 or data[0] != 0x53:
        return False
    frame = data[: data[1] + 2]
    if data[1] < 4 or len(frame) < data[1] + 2 or frame[-1] != 0x45:
        return False
    crc = 0xFF
    for byte in frame[1:-2]:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xD5 if crc & 1 else crc >> 1
    return crc == frame[-2]
