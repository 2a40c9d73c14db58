"""What a process says to the one that looks after it: length, then content. Both ends are ours."""

from __future__ import annotations

import os
import pickle
import struct
import traceback
from dataclasses import dataclass
from typing import Any

from tactbench.core import errors
from tactbench.core.errors import CellStopped, Raised, TactbenchError, _rebuild

_HEADER = struct.Struct("<Q")
_NUMBER = struct.Struct("<q")


@dataclass(frozen=True)
class Told:
    """An exception as plain text: code of a plugin's exceptions never runs in the process that looks after it."""

    kind: str
    """Name of the class in `tactbench.core.errors`; "" if it is none of these."""
    message: str
    hint: str
    traceback_text: str

    @staticmethod
    def of(error: BaseException) -> Told:
        """Put an exception into words."""
        text = "".join(traceback.format_exception(error))
        name = type(error).__name__
        if isinstance(error, TactbenchError) and getattr(errors, name, None) is type(error):
            return Told(name, str(error.message), str(error.hint), error.traceback_text or text)
        try:
            said = str(error)
        except Exception:
            said = "(its text cannot be read)"
        return Told("", f"{name}: {said}", "", text)

    def error(self, log: str) -> TactbenchError:
        """Return the exception that stands for it here; `log` is what was printed."""
        kind: type[TactbenchError] = getattr(errors, self.kind) if self.kind else Raised
        if issubclass(kind, CellStopped):
            return kind(self.message, hint=self.hint, log=log, traceback_text=self.traceback_text)
        error = _rebuild(kind, self.message, self.hint)
        error.traceback_text = self.traceback_text
        return error


@dataclass(frozen=True)
class Message:
    """What came of one item."""

    result: Any
    """A result, or a `Told`."""
    spent_s: float

    def send(self, link: int) -> None:
        """Write it whole; raises if the result cannot travel."""
        content = pickle.dumps(self, protocol=pickle.HIGHEST_PROTOCOL)
        left = memoryview(_HEADER.pack(len(content)) + content)
        while left:
            left = left[os.write(link, left) :]


class Inbox:
    """Gathers the bytes of one link until a message is whole."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def read(self, link: int) -> bool:
        """Take what is there; return False once nothing will ever come again."""
        while True:
            try:
                piece = os.read(link, 2**20)
            except BlockingIOError:
                return True
            if not piece:
                return False
            self._bytes += piece

    def message(self) -> Message | None:
        """Return the first whole message, or None; raises if it makes no sense."""
        if len(self._bytes) < _HEADER.size:
            return None
        (length,) = _HEADER.unpack_from(self._bytes)
        end = _HEADER.size + length
        if len(self._bytes) < end:
            return None
        content = bytes(self._bytes[_HEADER.size : end])
        del self._bytes[:end]
        message = pickle.loads(content)
        if not isinstance(message, Message):
            raise TypeError(f"a {type(message).__name__} came instead of a message")
        return message


def ask(link: int, number: int) -> None:
    """Ask the process at the other end for item `number`; ``~number`` only announces it."""
    os.write(link, _NUMBER.pack(number) + b"!")


def asked(link: int) -> int | None:
    """Return the number of the item asked for; None when there are no more.

    The last byte is read apart: who is killed while it waits may still be handed what it waits for, but reads no more.
    As long as there is something to read at `link`, the item has not begun.
    """
    content = os.read(link, _NUMBER.size)
    return _NUMBER.unpack(content)[0] if len(content) == _NUMBER.size and os.read(link, 1) else None
