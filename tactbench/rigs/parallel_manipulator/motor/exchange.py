"""Exchange of commands and answers with the drive: assigned in order, with timeouts, and separated from notices.

Answers name no command and have no checksum; the drive answers in the order of commands (sourced as in ``codec.py``).
So after a lost answer no line is assigned until the drive has answered a query whose answer is known: lines before that
are late.
"""

from __future__ import annotations

from collections import Counter, deque
from contextlib import suppress
from typing import NamedTuple

from tactbench.plugin.devices import ByteLink, Clock, LinkTimeout, PositionerError, PositionerSilentError
from tactbench.rigs.parallel_manipulator.motor.codec import LONGEST_ANSWER, Kind, Line, LineReader, encode, line_time_s

MARK = "VER"
"""Query with a known answer, the drive's version."""
IN_A_ROW = 3
"""Number of successive lost answers after which the drive counts as silent (assumed)."""
HOST_S = 0.15
"""Time added to that of the line [s]: an adapter may hold bytes for 16 ms, a busy host and an emulated drive be late by
some 60 ms (measured). A command whose answer is late was carried out or not: nothing else is sent meanwhile."""


class MotorRefusalError(PositionerError):
    """The drive has refused a command."""


class Answer(NamedTuple):
    """Outcome of a command: the answer, or its absence."""

    name: str
    command: str
    of: int | None
    """Number that was given to `send` with the command."""
    line: Line | None = None
    """Line of the answer; None: no answer came in time."""

    @property
    def value(self) -> int:
        """The answer's integer; raises the errors of :meth:`checked`."""
        return int(self.checked().text)

    def checked(self) -> Line:
        """Return the line; raises PositionerSilentError if no answer came, MotorRefusalError if the drive refuses."""
        if self.line is None:
            raise PositionerSilentError(
                f"The motor's drive did not answer {self.command} in time; it may have carried it out.",
                hint="Check the cable; read the position before the next move.",
            )
        if self.line.kind is Kind.REFUSAL:
            raise MotorRefusalError(
                f"The motor's drive refuses {self.command}: {self.line.text}.",
                hint="Check that it is a 300x RS drive, enabled and cool, and the rig file against its manual.",
            )
        return self.line


class Exchange:
    """Exchange that sends commands and assigns the received lines to them.

    Parameters
    ----------
    link
        Link to the drive.
    clock
        Clock of the link [ns].
    baud
        Rate of the line [bit/s], on which timeouts depend.

    Attributes
    ----------
    version
        Version of the drive, once :meth:`greet` has read it.
    fault
        True if the drive has sent notice of a fault since this attribute was last reset.
    counts
        Event counts: ``time_outs``, ``late`` answers, ``garbled`` and ``unexpected`` lines, ``refusals``.
    """

    def __init__(self, link: ByteLink, clock: Clock, baud: int) -> None:
        self.answer_s = 3.0 * line_time_s(LONGEST_ANSWER, baud) + HOST_S
        self.version = ""
        self.fault = False
        self.counts: Counter[str] = Counter()
        self._link, self._clock = link, clock
        self._reader = LineReader()
        self._out: deque[Answer] = deque()
        self._since_ns = self._missed = 0
        self._marking = False

    @property
    def ready(self) -> bool:
        """True if no answer is outstanding."""
        return not self._out and not self._marking

    def send(self, name: str, argument: int | None = None, of: int | None = None) -> None:
        """Send a command now, even if answers are outstanding: the drive keeps the order. The answer carries `of`."""
        if not self._out:
            self._since_ns = self._clock()
        command = encode(name, argument)
        self._link.write(command)
        self._out.append(Answer(name, command.decode().strip(), of))

    def pump(self, timeout_s: float) -> list[Answer]:
        """Read lines, waiting at most `timeout_s` for the first byte; return the outcomes of commands.

        Raises
        ------
        PositionerSilentError
            If three successive answers were lost.
        LinkUnplugged
            If the link is gone.
        """
        due_ns = self._since_ns + round(1e9 * self.answer_s * (3 if self._marking else 1))
        wait_s = timeout_s if self.ready else min(timeout_s, max(0.0, (due_ns - self._clock()) * 1e-9))
        found: list[Answer] = []
        with suppress(LinkTimeout):
            received = self._link.read(wait_s)
            for line in self._reader.feed(received.data, received.t_ns):
                found += self._assigned(line)
        return found if found or self.ready or self._clock() < due_ns else self._overdue()

    def ask(self, name: str, argument: int | None = None) -> Answer:
        """Send a command while no answer is outstanding, and return its outcome; raises the errors of :meth:`pump`."""
        self.send(name, argument)
        found: list[Answer] = []
        while not found:
            found = self.pump(self.answer_s)
        return found[0]

    def greet(self) -> str:
        """Find the drive: end a partial command on its line, and read its version twice.

        Raises
        ------
        LinkTimeout
            If the drive does not answer, or not twice the same.
        """
        self._link.write(b"\r")
        self.quiet()
        self.version = ""
        first, second = (self.ask(MARK).line for _ in range(2))
        if first is not None and second is not None and first.text == second.text and first.kind is not Kind.REFUSAL:
            self.version = first.text
            return first.text
        raise LinkTimeout(
            f"No drive on {self._link.address} gives the same answer to {MARK} twice.",
            hint="Check power, cable (crossed or not) and baud: a drive that was never set up has 9600. Drives of the "
            "newer, binary generation cannot be used.",
        )

    def quiet(self) -> None:
        """Drop data until the line has been silent for the time of an answer; for at most ten times this time."""
        deadline = self._clock() + round(1e10 * self.answer_s)
        with suppress(LinkTimeout):
            while self._clock() < deadline:
                self._link.read(self.answer_s)
        self._reader.clear()
        self._out.clear()
        self._marking, self._missed = False, 0

    def _assigned(self, line: Line) -> list[Answer]:
        if line.kind is Kind.NOTICE:
            self.fault |= line.text in "fr"
        elif line.kind is Kind.GARBLED:
            self.counts["garbled"] += 1
        elif self._marking:
            self._marking = line.text != self.version
            self.counts["late"] += self._marking
            self._since_ns = self._since_ns if self._marking else self._clock()
        elif self._out and line.answers(self._out[0].name):
            self.counts["refusals"] += line.kind is Kind.REFUSAL
            self._missed, self._since_ns = 0, self._clock()
            return [self._out.popleft()._replace(line=line)]
        else:
            self.counts["unexpected"] += 1
        return []

    def _overdue(self) -> list[Answer]:
        """Give up all outstanding answers, and send the query `MARK`; raises PositionerSilentError after too many."""
        lost = list(self._out)
        self._out.clear()
        self._reader.clear()
        self.counts["time_outs"] += len(lost)
        self._missed += 1
        if self._missed >= IN_A_ROW:
            self._missed, self._marking = 0, False
            raise PositionerSilentError(
                f"The motor's drive on {self._link.address} is silent: {IN_A_ROW} answers in a row did not come within "
                f"{self.answer_s:.2f} s.",
                hint="Check its power and cable. A moving motor completes its last move and holds.",
            )
        if self.version:
            self._marking, self._since_ns = True, self._clock()
            self._link.write(encode(MARK))
        return lost
