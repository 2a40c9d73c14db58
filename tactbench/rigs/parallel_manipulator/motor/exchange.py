"""Commands and answers on the drive's line: in order, within their time, apart from notices.

Answers name neither command nor drive and have no checksum; the drive answers in the order of commands (sourced as in
``codec.py``). So one command is out at a time; and after an answer that did not come, nothing is believed until the
drive has answered a question whose answer is known: what comes before is late.
"""

from __future__ import annotations

from collections import Counter, deque
from contextlib import suppress
from typing import NamedTuple

from tactbench.plugin.devices import ByteLink, Clock, LinkTimeout, Received
from tactbench.rigs.parallel_manipulator.motor.codec import (
    LONGEST_ANSWER,
    LONGEST_LINE,
    Kind,
    Line,
    LineReader,
    answers,
    encode,
    line_time_s,
    newer_generation,
)
from tactbench.rigs.parallel_manipulator.motor.errors import (
    REFUSALS,
    AnswerMissingError,
    MotorSilentError,
    WrongGenerationError,
)

MARK = "VER"
"""The question whose answer is known: the drive's version does not change."""
IN_A_ROW = 3
"""Answers that did not come one after the other, after which the drive is said to be silent (assumed)."""
HOST_S = 0.05
"""Added to what the line takes: an adapter may hold bytes for 16 ms, a host may be late by 10 ms (measured elsewhere,
docs/hardware.md)."""


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
        """Return the line.

        Raises
        ------
        AnswerMissingError
            If none came.
        MotorRefusalError
            If the drive refuses.
        """
        text = f"{self.name}{'' if self.argument is None else self.argument}"
        if self.line is None:
            raise AnswerMissingError(
                f"The motor's drive did not answer {text} in time; whether it was carried out is not known.",
                hint="Check cable and power; ask for position and target before the next move.",
            )
        if self.line.kind is Kind.REFUSAL:
            kind, hint = REFUSALS[self.line.text]
            raise kind(f"The motor's drive answers {text} with {self.line.text!r}.", hint=hint)
        return self.line


class Exchange:
    """One drive on a link.

    Parameters
    ----------
    link
        The drive's line.
    clock
        Of the link.
    baud
        Of the line: an answer is waited for three times as long as the longest one takes.
    node
        Address on a line with several drives; None: for every drive.

    Attributes
    ----------
    counts
        ``time_outs``; ``late`` lines that came before the known answer; ``unexpected`` lines that answer nothing;
        ``garbled`` ones; ``refusals``.
    notices
        Letters that the drive sent by itself, with when they came [ns]; for others to take away.
    answer_s
        How long an answer is waited for.
    """

    def __init__(self, link: ByteLink, clock: Clock, *, baud: int, node: int | None = None) -> None:
        self.counts: Counter[str] = Counter()
        self.notices: list[tuple[int, str]] = []
        self.answer_s = 3.0 * line_time_s(LONGEST_ANSWER, baud) + HOST_S
        self._link, self._clock, self._node = link, clock, node
        self._reader = LineReader()
        self._pending_commands: deque[tuple[str, int | None, object]] = deque()
        self._since_ns = 0
        self._known = ""
        self._marking = False
        self._missed = 0

    @property
    def ready(self) -> bool:
        """Whether no answer is waited for."""
        return not self._pending_commands and not self._marking

    def send(self, name: str, argument: int | None = None, of: object = None) -> None:
        """Send a command now, also while others are out: the drive keeps their order.

        `of` comes back with the answer.

        Raises
        ------
        LinkTimeout, LinkUnplugged
            As the link.
        """
        if not self._pending_commands:
            self._since_ns = self._clock()
        self._link.write(encode(name, argument, node=self._node))
        self._pending_commands.append((name, argument, of))

    def pump(self, timeout_s: float) -> list[Answer]:
        """Take what comes, and wait for the first of it at most so long; return what became of commands.

        Raises
        ------
        MotorSilentError
            If three answers in a row did not come.
        LinkUnplugged
            If it is gone.
        """
        wait_s = timeout_s
        if not self.ready:
            wait_s = min(wait_s, max(0.0, (self._due_ns() - self._clock()) * 1e-9))
        found: list[Answer] = []
        with suppress(LinkTimeout):
            found = self._taken(self._link.read(wait_s))
        return found if found or self.ready or self._clock() < self._due_ns() else self._overdue()

    def greet(self) -> str:
        """Find the drive: end whatever stands in its line, and ask for its version until two answers are the same.

        Returns
        -------
        str
            The version.

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
            while self._pending_commands:
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
        self._pending_commands.clear()
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
            self.notices.append((t_ns, line.text))
        elif line.kind is Kind.GARBLED:
            self.counts["garbled"] += 1
        elif self._marking:
            if line.text == self._known:
                self._marking = False
                self._since_ns = self._clock()
            else:
                self.counts["late"] += 1
        elif self._pending_commands and answers(line, self._pending_commands[0][0]):
            self.counts["refusals"] += int(line.kind is Kind.REFUSAL)
            self._missed = 0
            self._since_ns = self._clock()
            name, argument, of = self._pending_commands.popleft()
            return [Answer(name, argument, line, t_ns, of)]
        else:
            self.counts["unexpected"] += 1
        return []

    def _overdue(self) -> list[Answer]:
        """Give up what is out, and ask what is known; raises MotorSilentError."""
        now_ns = self._clock()
        lost = [Answer(name, argument, None, now_ns, of) for name, argument, of in self._pending_commands]
        self._pending_commands.clear()
        self.counts["time_outs"] += len(lost)
        self._missed += 1
        if self._missed >= IN_A_ROW:
            self._missed, self._marking = 0, False
            raise MotorSilentError(
                f"The motor's drive on {self._link.address} is silent: {IN_A_ROW} answers in a row did not come within "
                f"{self.answer_s:.2f} s.",
                hint="Check its power and cable. The motor, if it moves, ends its last move and holds.",
            )
        self._marking = True
        self._since_ns = now_ns
        self._reader.clear()
        self._link.write(encode(MARK, node=self._node))
        return lost
