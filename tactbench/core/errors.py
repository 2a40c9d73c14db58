"""Errors that tactbench raises for invalid input, data or plugins.

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
    """Root of all errors of tactbench: a message of what was given and expected, and a hint for the next step."""

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
    """Return the message of an error, preceded by the name of its class if the class is not part of tactbench."""
    return str(error) if isinstance(error, TactbenchError) else f"{type(error).__name__}: {error}".rstrip(": ")


class UsageError(TactbenchError):
    """A command or a call has invalid arguments or settings: exit code 2."""

    exit_code = 2


def nearest(given: str, known: Iterable[str]) -> list[str]:
    """Return the names of `known` that are similar to `given`, the most similar first."""
    names = sorted(known)
    folded = {name.casefold(): name for name in names}
    close = difflib.get_close_matches(given.casefold(), list(folded), n=3, cutoff=0.5)
    return [folded[name] for name in close]


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Return ``Did you mean …? `` with the names of `known` that are similar to `given`; empty if no name is."""
    close = " or ".join(map(repr, nearest(given, known)))
    return f"Did you mean {close}? " if close else ""


def complaint(error: ValidationError) -> str:
    """Return the first complaint of a pydantic error as ``place: message (given: value)``."""
    first = error.errors(include_url=False)[0]
    place, message = ".".join(map(str, first["loc"])), first["msg"].removeprefix("Value error, ")
    given = f" (given: {first['input']!r})" if isinstance(first["input"], str | int | float) else ""
    return f"{place}: {message}{given}" if place else message


def wrong(argument: str, given: object, takes: str) -> UsageError:
    """Return the error for an invalid value of an argument of a Python function."""
    shown = repr(given) if isinstance(given, str | type) else reprlib.repr(given)
    shown += f" of shape {given.shape}" if hasattr(given, "shape") else ""
    return UsageError(f"{argument}={shown} is not valid.", hint=f"`{argument}` must be {takes}.")


class UnknownNameError(UsageError):
    """No sensor, rig, task … has the given name; the hint has the most similar names."""

    def __init__(self, kind: str, given: str, known: Iterable[str]) -> None:
        names = sorted(known)
        listing = f"Known names: {', '.join(names)}." if names else f"No {kind} is installed."
        super().__init__(f"There is no {kind} called {given!r}.", hint=did_you_mean(given, names) + listing)


class ConfigError(UsageError):
    """A YAML file is not valid; the message begins with the file and the line."""

    def __init__(self, file: str, line: int | None, message: str, *, hint: str = "") -> None:
        where = f"{file}:{line}" if line else file
        super().__init__(f"{where}: {message}", hint=hint)


class FolderError(UsageError):
    """A result folder cannot be read or written, is in use by another run, or contradicts another folder."""


class PluginError(TactbenchError):
    """A plugin cannot be loaded or used."""


class DuplicateNameError(PluginError):
    """Two distributions define a sensor, task … of the same name."""

    exit_code = 2

    def __init__(self, kind: str, name: str, distributions: Sequence[str]) -> None:
        both = " and ".join(distributions)
        super().__init__(
            f"The {kind} {name!r} is defined by {both}; neither definition is used.",
            hint=f"Uninstall one of the distributions, or ask its author to rename the {kind}.",
        )


class PluginContractError(PluginError):
    """A plugin violates the interface that its hooks require."""


class RecordingError(TactbenchError):
    """A recording cannot be read or written."""


class FormatError(RecordingError, ValueError):
    """The file is not a recording of tactbench, or is damaged."""

    exit_code = 2


class MissingRecordingError(RecordingError, FileNotFoundError):
    """No recording is found at the given place."""

    exit_code = 2


class UnwritableError(RecordingError):
    """The folder or disk does not allow a recording to be written."""

    exit_code = 2


class MappingError(RecordingError, ValueError):
    """A table of another source does not match its mapping."""

    exit_code = 2


class RigError(TactbenchError):
    """A rig cannot be built, or cannot carry out a scene."""


class LinkError(TactbenchError):
    """A link to a device cannot be opened or used."""


class LinkClosed(LinkError):  # noqa: N818  (names what happened to the link, as its siblings do)
    """The link was closed before the operation."""


class LinkTimeout(LinkError):  # noqa: N818
    """No data were received, or could be sent, within the given time; the link remains usable."""


class LinkUnplugged(LinkError):  # noqa: N818
    """The device, its cable or the other end has disappeared; the link can only be closed."""


class DataError(TactbenchError, ValueError):
    """Recordings cannot be converted to features X and targets y."""


class NotApplicable(DataError):  # noqa: N818  (a result, not a failure)
    """The cell does not apply to its data: its row is ``skipped``, with this reason."""


class EngineError(TactbenchError):
    """The engine that computes cells has ended, or has other package versions than this process."""


class CellStopped(TactbenchError):  # noqa: N818  (a way to end, not one error)
    """A cell or a recording was stopped without a result.

    `signal` is the number of the signal that ended the process (None: no signal did), and `log` the last part of the
    output of the process.
    """

    spent_s: float | None = None
    """Time until the cell or recording was stopped [s]; None: not known."""
    status: Literal["failed", "crashed", "timeout", "out-of-memory"] = "crashed"

    def __init__(
        self, message: str, *, hint: str = "", signal: int | None = None, log: str = "", traceback_text: str = ""
    ) -> None:
        super().__init__(message, hint=hint)
        self.signal = signal
        self.log = log
        self.traceback_text = traceback_text


class Raised(CellStopped):
    """An error of another package was raised in another process; the message contains its type."""

    status = "failed"


class Crashed(CellStopped):
    """The process of a cell or a recording was ended by a signal, or exited by itself."""

    status = "crashed"


class TimedOut(CellStopped):
    """A cell or a recording took longer than its time limit."""

    status = "timeout"


class OutOfMemory(CellStopped):
    """A cell or a recording used more memory than its limit, or than is available."""

    status = "out-of-memory"
