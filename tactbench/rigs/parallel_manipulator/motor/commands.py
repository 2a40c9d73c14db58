"""Commands that are waited for: settings read back, and homing. Every wait has an end."""

from __future__ import annotations

from collections.abc import Callable

from tactbench.plugin.devices import Clock
from tactbench.rigs.parallel_manipulator.motor.codec import QUERIES, Configuration, Line, OperationStatus
from tactbench.rigs.parallel_manipulator.motor.errors import (
    MotorError,
    MotorFaultError,
    MotorStalledError,
    SettingNotKeptError,
)
from tactbench.rigs.parallel_manipulator.motor.exchange import Answer, Exchange

TRIES = 5
"""Answers of which two in a row must agree (assumed: damaged lines are rare)."""
HOMING_S = 60.0
"""Homing takes no longer (assumed)."""
FAULTS = OperationStatus.OVERVOLTAGE | OperationStatus.OVERTEMPERATURE


class Commands:
    """Asks one thing after the other.

    Parameters
    ----------
    exchange
        With the drive.
    clock
        Of its link.
    earlier
        Takes the answers to what was asked before.

    All methods raise AnswerMissingError, MotorSilentError, MotorRefusalError and LinkUnplugged.
    """

    def __init__(self, exchange: Exchange, clock: Clock, earlier: Callable[[Answer], None]) -> None:
        self._exchange, self._clock, self._earlier = exchange, clock, earlier

    def ask(self, name: str, argument: int | None = None) -> Line:
        """Return the answer to a command; a query that is not answered is asked again."""
        while True:
            while not self._exchange.ready:
                for answer in self._exchange.pump(self._exchange.answer_s):
                    self._earlier(answer)
            self._exchange.send(name, argument)
            found: list[Answer] = []
            while not found:
                found = self._exchange.pump(self._exchange.answer_s)
            if found[0].line is not None or name not in QUERIES:
                return found[0].checked()

    def do(self, name: str, argument: int | None = None) -> None:
        """Wait until a command is acknowledged."""
        self.ask(name, argument)

    def sure(self, query: str) -> int:
        """Return a number that two answers in a row agree on: there is no checksum. Raises MotorError."""
        before = None
        for _ in range(TRIES):
            value = self.ask(query).value
            if value == before:
                return value
            before = value
        raise MotorError(f"The motor's drive gives no two equal answers in a row to {query}.", hint="Is it at rest?")

    def configuration(self) -> Configuration:
        """Return what CST answers, twice the same."""
        return Configuration(self.sure("CST"))

    def keep(self, command: str, argument: int, query: str) -> None:
        """Set something and read it back; raises SettingNotKeptError."""
        for _ in range(2):
            self.do(command, argument)
            found = self.sure(query)
            if found == argument:
                return
        raise SettingNotKeptError(
            f"The motor's drive was told {command}{argument} and answers {query} with {found}.",
            hint="Check the option against the drive's manual, and the cable.",
        )

    def to_switch(self, speed: int, stop: Callable[[], bool]) -> None:
        """Run to the drive's reference switch, which is place 0 then.

        Raises
        ------
        MotorStalledError, MotorFaultError
            If it is not found within a minute, `stop` says so, or the drive reports a fault; the motor stands then.
        """
        self.do("HOSP", abs(speed))
        self.do("GOHOSEQ")
        try:
            self._until(
                lambda status: not status & OperationStatus.HOMING and bool(status & OperationStatus.POSITION_ATTAINED),
                stop,
                "its reference switch",
            )
        except MotorError:
            self.do("V", 0)
            raise

    def against_stop(self, speed: int, current: int, stop: Callable[[], bool]) -> None:
        """Run at a speed until the motor stands at its current limit; raises as :meth:`to_switch`.

        The current is limited to `current` meanwhile; once the stop is found, the drive has its limits again.
        """
        before = [("LPC", self.sure("GPC"), "GPC"), ("LCC", self.sure("GCC"), "GCC")]
        for command, argument, query in before:
            self.keep(command, min(current, argument), query)
        try:
            self.do("V", speed)
            self._until(
                lambda status: bool(status & OperationStatus.CURRENT_LIMITATION) and self.ask("GN").value == 0,
                stop,
                "an end stop",
            )
        finally:
            self.do("V", 0)
        for setting in before:
            self.keep(*setting)

    def _until(self, done: Callable[[OperationStatus], bool], stop: Callable[[], bool], what: str) -> None:
        """Wait until the status is so twice in a row; raises MotorStalledError, MotorFaultError."""
        deadline = self._clock() + round(1e9 * HOMING_S)
        times = 0
        while times < 2:
            status = OperationStatus(self.ask("OST").value)
            if status & FAULTS:
                raise MotorFaultError(
                    "The motor's drive reports a fault while it looks for its place.",
                    hint="Clear the cause, then enable and home it again.",
                )
            times = times + 1 if done(status) else 0
            if stop():
                raise MotorStalledError(f"The motor was told to stand while it looked for {what}.")
            if self._clock() > deadline:
                raise MotorStalledError(
                    f"The motor has not found {what} within {HOMING_S:g} s.",
                    hint="Check homing, homing_speed_m_s and homing_current_a in the rig file.",
                )
