"""Commands to the drive, queries and their answers: one query at a time, with timeouts, separated from notices.

Answers name no command and have no checksum; the drive answers in the order of commands (sourced as in ``codec.py``).
So after a lost answer no line is taken for another answer until the drive has answered a query whose answer is known:
lines before that are late. What a command has done is seen from a later query; its ``OK`` is not waited for.
"""

from __future__ import annotations

from collections import Counter, deque
from contextlib import suppress
from typing import NamedTuple

from tactbench.plugin.devices import ByteLink, Clock, LinkTimeout, PositionerError, PositionerSilentError
from tactbench.rigs.parallel_manipulator.motor.codec import (
    LONGEST_ANSWER,
    MARK,
    Kind,
    Line,
    LineReader,
    encode,
    line_time_s,
)

IN_A_ROW = 3
"""Number of successive lost answers after which the drive counts as silent (assumed)."""
HOST_S = 0.15
"""Time added to that of the line [s]: an adapter may hold bytes for 16 ms, a busy host and an emulated drive be late by
some 60 ms (measured)."""


class MotorRefusalError(PositionerError):
    """The drive has refused a command."""


class Answer(NamedTuple):
    """Outcome of a query."""

    query: str
    line: Line | None
    """Line of the answer; None: no answer came in time."""


class Exchange:
    """Exchange that sends commands and queries, and finds the answers among the received lines.

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
        Event counts: ``time_outs``, ``garbled`` and ``unexpected`` lines, ``refusals``.
    """

    def __init__(self, link: ByteLink, clock: Clock, baud: int) -> None:
        self.answer_s = 3.0 * line_time_s(LONGEST_ANSWER, baud) + HOST_S
        self.version = ""
        self.fault = False
        self.counts: Counter[str] = Counter()
        self._link, self._clock = link, clock
        self._reader = LineReader()
        self._lines: deque[Line] = deque()
        self._query = self._command = ""
        self._since_ns = self._missed = 0
        self._marking = False

    @property
    def ready(self) -> bool:
        """True if no answer is outstanding."""
        return not self._query

    def send(self, name: str, argument: int | None = None) -> None:
        """Send a command now, even if an answer is outstanding: the drive keeps the order."""
        command = encode(name, argument)
        self._link.write(command)
        self._command = command.decode().strip()

    def query(self, name: str) -> None:
        """Send a query; permitted only while no answer is outstanding."""
        self._query, self._since_ns = name, self._clock()
        self._link.write(encode(name))

    def pump(self, timeout_s: float) -> Answer | None:
        """Read lines, waiting at most `timeout_s` for the first byte; return the outcome of the query, if known.

        Raises MotorRefusalError if the drive refuses a command, PositionerSilentError if three successive answers were
        lost, and LinkUnplugged if the link is gone.
        """
        due_ns = self._since_ns + round(1e9 * self.answer_s * (3 if self._marking else 1))
        wait_s = timeout_s if self.ready else min(timeout_s, max(0.0, (due_ns - self._clock()) * 1e-9))
        with suppress(LinkTimeout):
            received = self._link.read(wait_s)
            self._lines += self._reader.feed(received.data, received.t_ns)
        while self._lines:
            if self._ends(line := self._lines.popleft()):
                query, self._query = self._query, ""
                return Answer(query, line)
        return None if self.ready or self._clock() < due_ns else self._overdue()

    def ask(self, name: str) -> Line:
        """Return the answer to a query, sent again after a lost answer; raises the errors of :meth:`pump`."""
        while True:
            if self.ready:
                self.query(name)
            answer = self.pump(self.answer_s)
            if answer is not None and answer.query == name and answer.line is not None:
                return answer.line

    def greet(self) -> str:
        """Find the drive: end a partial command on its line, and read its version twice.

        Raises LinkTimeout if the drive does not answer, or its two answers differ.
        """
        self._link.write(b"\r")
        self.quiet()
        self.version = ""
        with suppress(PositionerSilentError):
            first, second = self.ask(MARK), self.ask(MARK)
            if first.text == second.text:
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
        self._lines.clear()
        self._query, self._marking, self._missed = "", False, 0

    def _ends(self, line: Line) -> bool:
        """Return True if a line is the answer to the query."""
        match line.kind:
            case Kind.NOTICE:
                self.fault |= line.text in "fr"
            case Kind.GARBLED:
                self.counts["garbled"] += 1
            case Kind.REFUSAL:
                self.counts["refusals"] += 1
                raise MotorRefusalError(
                    f"The motor's drive refuses {self._command}, or an earlier command: {line.text}.",
                    hint="Check that it is a 300x RS drive, enabled and cool, and the rig file against its manual.",
                )
            case Kind.VALUE | Kind.TEXT if self._marking and line.text == self.version:
                self._marking, self._query = False, ""
            case Kind.VALUE | Kind.TEXT if not self._marking and line.answers(self._query):
                self._missed = 0
                return True
            case Kind.VALUE | Kind.TEXT:
                self.counts["unexpected"] += 1
        return False

    def _overdue(self) -> Answer | None:
        """Give up the outstanding answer, and send the query `MARK`; raises PositionerSilentError after too many."""
        lost = None if self._marking else Answer(self._query, None)
        self._reader.clear()
        self._query = ""
        self.counts["time_outs"] += 1
        self._missed += 1
        if self._missed >= IN_A_ROW:
            self._missed, self._marking = 0, False
            raise PositionerSilentError(
                f"The motor's drive on {self._link.address} is silent: {IN_A_ROW} answers in a row did not come within "
                f"{self.answer_s:.2f} s.",
                hint="Check its power and cable. A moving motor completes its last move and holds.",
            )
        if self.version:
            self._marking = True
            self.query(MARK)
        return lost
