"""Faulhaber ASCII over RS232: options, units, and encoding of commands and answers, without input or output.

A command is ``NAME[argument]`` and CR; an answer is a line that ends with CR LF and names no command (sourced:
Faulhaber manual MCBL 3564K024B CS, chapter 5, published at manualshive.com). Between a command and its answer the drive
may put notices: single letters on a line of their own. The protocol has no checksum: a digit that becomes another digit
on the line cannot be detected, so that limits, and the position before a move, must be read twice.

No public document known here states the units of the linear drives (MCLM 300x RS), and Karl et al. 2016 name no motor:
the defaults are assumed, and a rig file has to state the units of its drive.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from enum import Enum, IntFlag
from typing import Literal, NamedTuple, Self

from pydantic import Field, model_validator

from tactbench.plugin import RigError
from tactbench.plugin.devices import PositionerOptions

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
MARK = "VER"
"""Query with a known answer, a text: the drive's version. Other queries are answered by a number, commands by `OK`."""


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
        return bool(query) and (self.kind is Kind.VALUE or (self.kind is Kind.TEXT and query == MARK))


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


LARGEST_POSITION, LARGEST_SPEED, LARGEST_ACCELERATION, LARGEST_CURRENT = 1_800_000_000, 10_000, 30_000, 12_000
"""Largest arguments of LA; SP and V; AC and DEC; LPC and LCC (assumed)."""


class FaulhaberOptions(PositionerOptions):
    """Options of a motor and its drive; settings left out remain as stored in the drive."""

    baud: int = Field(default=9600, gt=0)
    """Rate of the line [bit/s], as in the link's address; timeouts depend on it."""
    increment_m: float = Field(default=6e-6, gt=0.0)
    """Length of one increment [m] (assumed: 3000 per 18 mm of magnet pitch, in no document read)."""
    speed_unit_m_s: float = Field(default=1e-3, gt=0.0)
    """Value of one unit of SP, V, GN [m/s] (assumed: by analogy with rpm of the rotary drives)."""
    acceleration_unit_m_s2: float = Field(default=1e-3, gt=0.0)
    """Value of one unit of AC and DEC [m/s^2] (assumed likewise)."""
    current_unit_a: float = Field(default=1e-3, gt=0.0)
    """Current per unit of the commands LPC, LCC [A] (sourced: Faulhaber manual MCBL 3564K024B CS, the rotary drive)."""
    lower_m: float | None = Field(default=None, lt=0.0)
    """Ends of travel [m]; the drive needs a negative and a positive end."""
    upper_m: float | None = Field(default=None, gt=0.0)
    peak_current_a: float | None = Field(default=None, gt=0.0)
    """Limit of the peak current, sent to the drive [A]; see :attr:`current_limit_a`."""
    force_constant_n_a: float | None = Field(default=None, gt=0.0)
    """Force per current [N/A]; its product with the current limit is the largest force."""
    homing: Literal["here", "end-stop"] = "here"
    """Origin of positions: the motor's present place, or an end stop that it runs against."""
    homing_speed_m_s: float = 0.005
    """Speed towards the end stop [m/s]; negative: towards negative positions."""
    homing_current_a: float = Field(default=0.2, gt=0.0)
    """Limit of current while running against an end stop [A]."""

    @model_validator(mode="after")
    def _sendable(self) -> Self:
        if self.peak_force_n is not None and self.force_constant_n_a is None:
            raise ValueError("peak_force_n needs force_constant_n_a, because the drive limits the current")
        return self

    @property
    def current_limit_a(self) -> float | None:
        """Current limit that is sent to the drive [A]: `peak_current_a`, or the current at `peak_force_n` if lower.

        None: neither option is stated.
        """
        limits_a = [] if self.peak_current_a is None else [self.peak_current_a]
        if self.peak_force_n is not None and self.force_constant_n_a is not None:
            limits_a.append(self.peak_force_n / self.force_constant_n_a)
        return min(limits_a, default=None)

    @property
    def largest_force_n(self) -> float | None:
        """Largest force [N]: current limit times force constant; None unless both are stated."""
        limit_a, constant = self.current_limit_a, self.force_constant_n_a
        return None if limit_a is None or constant is None else limit_a * constant

    @property
    def force_source(self) -> str:
        """Source of :attr:`largest_force_n`, for the tables of `doctor`."""
        return f"sent current limit, {self.current_limit_a:g} A" if self.largest_force_n else super().force_source

    def homes_towards(self) -> int:
        """Return the sign of the homing speed towards an end stop; 0: homing without motion."""
        return int(math.copysign(1, self.homing_speed_m_s)) if self.homing == "end-stop" else 0

    # The drive's integers; each conversion raises RigError for a value that the drive does not take.

    def increments(self, position_m: float) -> int:
        """Return the argument of LA nearest to a position [m]."""
        return _whole(position_m, self.increment_m, LARGEST_POSITION, "position", round)

    def position_m(self, increments: float) -> float:
        """Return the position [m] of a number of increments."""
        return increments * self.increment_m

    def speed(self, speed_m_s: float) -> int:
        """Return the argument of SP or V for a speed [m/s], rounded towards 0; it keeps the sign."""
        return _whole(speed_m_s, self.speed_unit_m_s, LARGEST_SPEED, "speed")

    def acceleration(self, acceleration_m_s2: float) -> int:
        """Return the argument of AC or DEC for an acceleration [m/s^2], rounded down."""
        return _whole(acceleration_m_s2, self.acceleration_unit_m_s2, LARGEST_ACCELERATION, "acceleration")

    def current(self, current_a: float) -> int:
        """Return the argument of LPC or LCC for a current [A], rounded down."""
        return _whole(current_a, self.current_unit_a, LARGEST_CURRENT, "current")


def _whole(value: float, unit: float, largest: int, what: str, rounded: Callable[[float], int] | None = None) -> int:
    """Return a value in units of the drive, rounded down by default; only 0 itself may be rounded down to 0."""
    steps = value / unit if math.isfinite(value) else largest + 1
    # A quotient that is an integer but for rounding is that integer, not the one below.
    steps = int(steps * (1.0 + 4e-16)) if rounded is None else rounded(steps)
    if abs(steps) > largest or (steps == 0 != value and rounded is None):
        raise RigError(
            f"The drive cannot be set to a {what} of {value:g}: the unit is {unit:g}, the limit {largest} units.",
            hint="Check this value and the drive's units in the rig file.",
        )
    return steps
