"""Why an item of work ended without a result, in words."""

from __future__ import annotations

import signal

from tactbench.core.errors import Crashed, OutOfMemory, TimedOut
from tactbench.core.pool.limits import Limits

FATAL = "Fatal Python error"
"""Begins what Python's fault handler writes when the process is about to end."""


def too_slow(limits: Limits) -> TimedOut:
    """Say that the time is up."""
    return TimedOut(
        f"It was stopped: it took longer than {limits.timeout_s:g} s.", hint="Allow more with --timeout SECONDS."
    )


def out_of_memory(limits: Limits, error: MemoryError | None = None, traceback_text: str = "") -> OutOfMemory:
    """Say that it took more memory than it may, or that there was none left."""
    why = f" ({error})" if error is not None and str(error) else ""
    if limits.memory_mb is None:
        return OutOfMemory(f"Memory ran out{why}.", hint="Run fewer at once (--jobs).", traceback_text=traceback_text)
    return OutOfMemory(
        f"It was stopped: it asked for more than {limits.memory_mb} MB of memory{why}.",
        hint="Allow more with --memory MB.",
        traceback_text=traceback_text,
    )


def silenced() -> Crashed:
    """Say that a process has cut itself off."""
    return Crashed(
        "It closed the pipe that its result should have come by, and so gave no result.",
        hint="Something in it closes what is not its own, as os.closerange does.",
    )


def garbled(error: Exception) -> Crashed:
    """Say that what came through the pipe of the result is none."""
    return Crashed(
        f"What came through the pipe of its result is no result: {error}.",
        hint="Something in it writes to a descriptor that is not its own.",
    )


def never_began(seconds: float) -> Crashed:
    """Say that a process did not begin with its item."""
    return Crashed(f"Its process did not begin within {seconds:g} s.", hint="Run fewer at once (--jobs).")


def crashed(code: int, log: str, *, memory_was_short: bool) -> Crashed | OutOfMemory:
    """Say how a process ended that gave no result.

    Parameters
    ----------
    code
        Its exit code, or the number of the signal that ended it, negative.
    log
        What it printed, with what Python's fault handler has to say at its end.
    memory_was_short
        Whether the system has ended processes for want of memory while it ran.
    """
    where = FATAL + log.rpartition(FATAL)[2] if FATAL in log else ""
    if code >= 0:
        return Crashed(
            f"Its process ended itself with exit code {code} and gave no result.",
            hint="Something in it calls os._exit or closes what is not its own.",
            log=log,
        )
    number = -code
    if number == signal.SIGKILL and memory_was_short:
        return OutOfMemory(
            "The system ended its process because memory was short.",
            hint="Run fewer at once (--jobs), or give each a limit (--memory MB).",
            signal=number,
            log=log,
        )
    return Crashed(
        f"Its process was ended by signal {number} ({signal_name(number)}).",
        hint="What it printed last may say where.",
        signal=number,
        log=log,
        traceback_text=where,
    )


def signal_name(number: int) -> str:
    """Return the name of a signal."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return "unknown"
