"""Errors that tactbench raises on purpose.

::

    TactbenchError
    ├── UsageError: UnknownNameError, ConfigError, FolderError
    ├── PluginError: DuplicateNameError, PluginContractError
    ├── RecordingError: FormatError, MissingRecordingError, UnwritableError, MappingError
    ├── RigError
    ├── LinkError: LinkClosed, LinkTimeout, LinkUnplugged
    ├── DataError: NotApplicable
    ├── EngineError
    └── CellStopped: Raised, Crashed, TimedOut, OutOfMemory

Every message names what was given, what was expected and the next step.
"""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from pydantic import ValidationError


class TactbenchError(Exception):
    """Root of all errors of tactbench: a message of what was given and expected, and a hint at the next step."""

    exit_code = 1
    traceback_text = ""
    """Traceback of the error, if it was raised in another process."""

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} {self.hint}".strip()

    def __reduce__(self) -> tuple[object, ...]:
        # Errors cross process borders as plain text, whatever arguments a subclass takes.
        plain = {name: value for name, value in vars(self).items() if isinstance(value, str | int | float | None)}
        return (_rebuild, (type(self), self.message, self.hint), plain)


def _rebuild(kind: type[TactbenchError], message: str, hint: str) -> TactbenchError:
    error = kind.__new__(kind)
    TactbenchError.__init__(error, message, hint=hint)
    return error


def error_text(error: BaseException) -> str:
    """Return the message of an error, behind its class where that is not one of tactbench's."""
    return str(error) if isinstance(error, TactbenchError) else f"{type(error).__name__}: {error}".rstrip(": ")


class UsageError(TactbenchError):
    """A command or a call cannot be carried out as it is given: exit code 2."""

    exit_code = 2


def nearest(given: str, known: Iterable[str]) -> list[str]:
    """Return the names of `known` that look like `given`, best first."""
    names = sorted(known)
    folded = {name.casefold(): name for name in names}
    close = difflib.get_close_matches(given.casefold(), list(folded), n=3, cutoff=0.5)
    return [folded[name] for name in close]


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Return ``Did you mean …? `` for the names of `known` that look like `given`; empty if none does."""
    close = " or ".join(map(repr, nearest(given, known)))
    return f"Did you mean {close}? " if close else ""


def complaint(error: ValidationError) -> str:
    """Return the first complaint of pydantic as ``place: message (given: value)``."""
    first = error.errors(include_url=False)[0]
    place, message = ".".join(map(str, first["loc"])), first["msg"].removeprefix("Value error, ")
    given = f" (given: {first['input']!r})" if isinstance(first["input"], str | int | float) else ""
    return f"{place}: {message}{given}" if place else message


def wrong(argument: str, given: object, takes: str) -> UsageError:
    """Return the error of a function in Python for a value that its argument does not take."""
    shown = repr(given) if isinstance(given, str | type) else reprlib.repr(given)
    shown += f" of shape {given.shape}" if hasattr(given, "shape") else ""
    return UsageError(f"{argument}={shown} cannot be used.", hint=f"`{argument}` takes {takes}.")


class UnknownNameError(UsageError):
    """There is no sensor, rig, task … with a given name; the hint has the nearest names."""

    def __init__(self, kind: str, given: str, known: Iterable[str]) -> None:
        names = sorted(known)
        listing = f"Known names: {', '.join(names)}." if names else f"No {kind} is installed."
        super().__init__(f"There is no {kind} called {given!r}.", hint=did_you_mean(given, names) + listing)


class ConfigError(UsageError):
    """A YAML file is not valid; the message begins with file and line."""

    def __init__(self, file: str, line: int | None, message: str, *, hint: str = "") -> None:
        where = f"{file}:{line}" if line else file
        super().__init__(f"{where}: {message}", hint=hint)


class FolderError(UsageError):
    """A result folder cannot be read or written, is held by another run, or contradicts another one."""


class PluginError(TactbenchError):
    """A plugin cannot be used."""


class DuplicateNameError(PluginError):
    """Two distributions give one name to two things of one kind."""

    exit_code = 2

    def __init__(self, kind: str, name: str, distributions: Sequence[str]) -> None:
        both = " and ".join(distributions)
        super().__init__(
            f"The {kind} {name!r} is defined by {both}; neither is used.",
            hint="Uninstall one of them, or ask its author to rename it.",
        )


class PluginContractError(PluginError):
    """A plugin does not keep the interface it promised."""


class RecordingError(TactbenchError):
    """A recording cannot be read or written."""


class FormatError(RecordingError, ValueError):
    """Not a tactbench recording, or a damaged one."""

    exit_code = 2


class MissingRecordingError(RecordingError, FileNotFoundError):
    """There is no such recording."""

    exit_code = 2


class UnwritableError(RecordingError):
    """The folder or disk of a recording refuses it."""

    exit_code = 2


class MappingError(RecordingError, ValueError):
    """A foreign table does not fit its mapping."""

    exit_code = 2


class RigError(TactbenchError):
    """A rig cannot carry out a scene."""


class LinkError(TactbenchError):
    """A link to a device cannot be opened or used."""


class LinkClosed(LinkError):  # noqa: N818  (names what happened to the link, as its siblings do)
    """The link was closed."""


class LinkTimeout(LinkError):  # noqa: N818
    """Nothing came, or nothing could be sent, within the time given; the link may be used on."""


class LinkUnplugged(LinkError):  # noqa: N818
    """The device, its cable or the other end is gone; only closing is left."""


class DataError(TactbenchError, ValueError):
    """Recordings cannot be turned into X and y."""


class NotApplicable(DataError):  # noqa: N818  (a result, not a failure)
    """The cell does not apply: its row is ``skipped`` with this reason."""


class EngineError(TactbenchError):
    """The engine that computes cells is gone, or has other versions than this process."""


class CellStopped(TactbenchError):  # noqa: N818  (a way to end, not one error)
    """A cell or a recording ended without a result.

    Parameters
    ----------
    message, hint, traceback_text
        As of every error.
    signal
        Number of the signal that ended its process; None: no signal did.
    log
        The end of its output.
    """

    spent_s: float | None = None
    """Time until it ended [s]; None: not known."""
    status: Literal["failed", "crashed", "timeout", "out-of-memory"] = "crashed"

    def __init__(
        self, message: str, *, hint: str = "", signal: int | None = None, log: str = "", traceback_text: str = ""
    ) -> None:
        super().__init__(message, hint=hint)
        self.signal = signal
        self.log = log
        self.traceback_text = traceback_text


class Raised(CellStopped):
    """An error of another package was raised in another process; the message names its type."""

    status = "failed"


class Crashed(CellStopped):
    """Its process was ended by a signal, or ended itself."""

    status = "crashed"


class TimedOut(CellStopped):
    """It took longer than it may."""

    status = "timeout"


class OutOfMemory(CellStopped):
    """It took more memory than it may, or than there is."""

    status = "out-of-memory"
