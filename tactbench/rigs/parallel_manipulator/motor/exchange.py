"""Commands and answers on the drive's line: in order, within their time, apart from notices.

Answers name neither command nor drive and have no checksum; the drive answers in the order of commands (sourced as in
``codec.py``). So one command is out at a time; and after an answer that did not come, nothing is believed until the
drive has answered a question whose answer is known: what comes before is late.
"""

from __future__ import annotations

from collections import Counter, deque
from contextlib import suppress
from typing import NamedTuple

from tactbench.plugin.devices import ByteLink, Clock, LinkTimeout, PositionerError, PositionerSilentError, Received
from tactbench.rigs.parallel_manipulator.motor.codec import (
    FLASH_DEFECT,
    INVALID_PARAMETER,
    LONGEST_ANSWER,
    LONGEST_LINE,
    NOT_AVAILABLE,
    OVERTEMPERATURE,
    UNKNOWN_COMMAND,
    Kind,
    Line,
    LineReader,
    answers,
    encode,
    line_time_s,
    newer_generation,
)

MARK = "VER"
"""The question whose answer is known: the drive's version does not change."""
IN_A_ROW = 3
"""Answers that did not come one after the other, after which the drive is said to be silent (assumed)."""
HOST_S = 0.05
"""Added to what the line takes: an adapter may hold bytes for 16 ms, a host may be late by 10 ms (measured elsewhere,
docs/hardware.md)."""
_HINTS = {
    UNKNOWN_COMMAND: "Is it a Faulhaber drive of the 300x RS generation?",
    INVALID_PARAMETER: "Check the options in the rig file against the drive's manual.",
    NOT_AVAILABLE: "Is the drive enabled, and does it have this command?",
    OVERTEMPERATURE: "Let it cool down, then enable it again.",
    FLASH_DEFECT: "The drive cannot keep settings: ask its maker.",
}


class MotorError(PositionerError):
    """The motor or its drive does not do what it was asked for."""


class MotorSilentError(MotorError, PositionerSilentError):
    """A command was not answered, or nothing is answered any more."""


class MotorRefusalError(MotorError):
    """The drive refuses a command; `text` is its own."""

    text = ""


class WrongGenerationError(MotorError):
    """The drive speaks the newer, binary protocol."""


class Answer(NamedTuple):
    """What became of a command."""

    name: str
    argument: int | None
    line: Line | None
    """None: no answer came in time."""
    t_ns: int
    """When the first byte of its line was in the host; of a missing answer, when it was given up."""
    of: object = None
    """What `send` was given with it."""

    @property
    def value(self) -> int:
        """The integer; raises as :meth:`checked`."""
        return self.checked().value

    def checked(self) -> Line:
        """Return the line; raises MotorSilentError if none came, MotorRefusalError if the drive refuses."""
        text = f"{self.name}{'' if self.argument is None else self.argument}"
        if self.line is None:
            raise MotorSilentError(
                f"The motor's drive did not answer {text} in time; whether it was carried out is not known.",
                hint="Check the cable; read the position before the next move.",
            )
        if self.line.kind is Kind.REFUSAL:
            error = MotorRefusalError(
                f"The motor's drive answers {text} with: {self.line.text}.", hint=_HINTS[self.line.text]
            )
            error.text = self.line.text
            raise error
        return self.line


class Exchange:
    """Sends commands and assigns lines to them.

    Parameters
    ----------
    link
        To the drive.
    clock
        Of the link.
    baud
        Of the line: time-outs go by it.
    node
        Address of the drive; None: the only one.

    Attributes
    ----------
    notices
        Letters that the drive sent by itself and nobody has taken yet.
    counts
        ``time_outs``, ``late`` answers, ``garbled`` and ``unexpected`` lines, ``refusals``.
    """

    def __init__(self, link: ByteLink, clock: Clock, *, baud: int, node: int | None = None) -> None:
        self.answer_s = 3.0 * line_time_s(LONGEST_ANSWER, baud) + HOST_S
        self.notices: deque[str] = deque(maxlen=100)
        self.counts: Counter[str] = Counter()
        self._link, self._clock, self._node = link, clock, node
        self._reader = LineReader()
        self._out: deque[tuple[str, int | None, object]] = deque()
        self._since_ns = 0
        self._known = ""
        self._marking = False
        self._missed = 0

    @property
    def ready(self) -> bool:
        """Whether no answer is waited for."""
        return not self._out and not self._marking

    def send(self, name: str, argument: int | None = None, of: object = None) -> None:
        """Send a command now, also while others are out: the drive keeps their order. `of` comes with the answer."""
        if not self._out:
            self._since_ns = self._clock()
        self._link.write(encode(name, argument, node=self._node))
        self._out.append((name, argument, of))

    def pump(self, timeout_s: float) -> list[Answer]:
        """Take what comes, and wait for the first of it at most so long; return what became of commands.

        Raises
        ------
        MotorSilentError
            If three answers in a row did not come.
        LinkUnplugged
            If the link is gone.
        """
        wait_s = timeout_s
        if not self.ready:
            wait_s = min(wait_s, max(0.0, (self._due_ns() - self._clock()) * 1e-9))
        found: list[Answer] = []
        with suppress(LinkTimeout):
            found = self._taken(self._link.read(wait_s))
        return found if found or self.ready or self._clock() < self._due_ns() else self._overdue()

    def greet(self) -> str:
        """Find the drive: end what stands in its line, and ask for its version until two answers are the same.

        Raises
        ------
        LinkTimeout
            If it does not answer.
        WrongGenerationError
            If it is of the newer generation.
        """
        self._link.write(b"\r")
        self.quiet()
        before, self._known = None, ""
        for _ in range(5):
            self.send(MARK)
            line = None
            while self._out:
                for answer in self.pump(self.answer_s):
                    line = answer.line
                if self._marking:  # Not known yet: ask again instead.
                    self._marking = False
                    self.quiet()
            if line is not None and line.kind is not Kind.REFUSAL:
                if line.text == before:
                    self._known = before
                    return before
                before = line.text
        raise LinkTimeout(
            f"No drive on {self._link.address} answers {MARK} twice with the same.",
            hint="Check power, cable (crossed or not), node and baud: a drive that was never set up has 9600.",
        )

    def quiet(self) -> None:
        """Drop what comes until nothing has come for the time of an answer; at most ten times that."""
        seen = bytearray()
        deadline = self._clock() + round(1e10 * self.answer_s)
        with suppress(LinkTimeout):
            while self._clock() < deadline:
                seen += self._link.read(self.answer_s).data
                self._refuse_newer(seen[-LONGEST_LINE:])
        self._reader.clear()
        self._out.clear()
        self._marking, self._missed = False, 0

    def _due_ns(self) -> int:
        return self._since_ns + round(1e9 * self.answer_s * (3 if self._marking else 1))

    def _refuse_newer(self, data: bytes | bytearray) -> None:
        if any(newer_generation(bytes(data[start:])) for start, byte in enumerate(data) if byte == 0x53):
            raise WrongGenerationError(
                "The motor's drive speaks the binary protocol of the newer Faulhaber generation.",
                hint="Only drives of the 300x RS generation, with ASCII commands, can be used.",
            )

    def _taken(self, received: Received) -> list[Answer]:
        if not self._known:
            self._refuse_newer(received.data)
        return [answer for line in self._reader.stamped(received) for answer in self._routed(*line)]

    def _routed(self, line: Line, t_ns: int) -> list[Answer]:
        if line.kind is Kind.NOTICE:
            self.notices.append(line.text)
        elif line.kind is Kind.GARBLED:
            self.counts["garbled"] += 1
        elif self._marking:
            if line.text == self._known:
                self._marking = False
                self._since_ns = self._clock()
            else:
                self.counts["late"] += 1
        elif self._out and answers(line, self._out[0][0]):
            self.counts["refusals"] += int(line.kind is Kind.REFUSAL)
            self._missed = 0
            self._since_ns = self._clock()
            name, argument, of = self._out.popleft()
            return [Answer(name, argument, line, t_ns, of)]
        else:
            self.counts["unexpected"] += 1
        return []

    def _overdue(self) -> list[Answer]:
        """Give up what is out, and ask what is known; raises MotorSilentError."""
        now_ns = self._clock()
        lost = [Answer(name, argument, None, now_ns, of) for name, argument, of in self._out]
        self._out.clear()
        self.counts["time_outs"] += len(lost)
        self._missed += 1
        if self._missed >= IN_A_ROW:
            self._missed, self._marking = 0, False
            raise MotorSilentError(
                f"The motor's drive on {self._link.address} is silent: {IN_A_ROW} answers in a row did not come within "
                f"{self.answer_s:.2f} s.",
                hint="Check its power and cable. The motor, if it moves, ends its last move and holds.",
            )
        self._marking, self._since_ns = True, now_ns
        self._reader.clear()
        self._link.write(encode(MARK, node=self._node))
        return lost
