"""What a child process sends to its parent: JSON and arrays, never pickle, so that no code of a plugin runs there."""

from __future__ import annotations

import json
import os
import struct
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING, Any

from tactbench.core import errors
from tactbench.core.errors import CellStopped, Raised, TactbenchError, _rebuild

if TYPE_CHECKING:
    import numpy.typing as npt

_HEADER = struct.Struct("<8sQQ")
"""Magic number, bytes of JSON, bytes of arrays."""
_MAGIC = b"tactpool"
MOST_BYTES = 2**30
"""No message is longer: 1 GiB is a hundred million answers."""
_ARRAY, _TUPLE = "__array__", "__tuple__"


def pack(message: dict[str, Any]) -> bytes:
    """Return a message as bytes: JSON, then its arrays in numpy's npy format.

    Raises
    ------
    TypeError, ValueError
        If it holds anything but dictionaries by strings, lists, tuples, text, numbers, None and arrays of these.
    """
    arrays: list[npt.NDArray[Any]] = []
    text = json.dumps(_plain(message, arrays)).encode()
    content = BytesIO()
    for array in arrays:
        sys.modules["numpy"].save(content, array, allow_pickle=False)
    return _HEADER.pack(_MAGIC, len(text), content.tell()) + text + content.getvalue()


def _plain(value: Any, arrays: list[npt.NDArray[Any]]) -> Any:
    numpy = sys.modules.get("numpy")  # where it is not loaded, there are no arrays
    if numpy is not None and isinstance(value, numpy.ndarray):
        arrays.append(value)
        return {_ARRAY: len(arrays) - 1}
    if isinstance(value, dict):
        if not all(isinstance(key, str) for key in value) or value.keys() & {_ARRAY, _TUPLE}:
            raise TypeError("a dictionary's keys must be text")
        return {key: _plain(one, arrays) for key, one in value.items()}
    if isinstance(value, tuple):
        return {_TUPLE: [_plain(one, arrays) for one in value]}
    if isinstance(value, list):
        return [_plain(one, arrays) for one in value]
    return value


def _restored(value: Any, arrays: list[npt.NDArray[Any]]) -> Any:
    if isinstance(value, list):
        return [_restored(one, arrays) for one in value]
    if isinstance(value, dict):
        if value.keys() == {_ARRAY}:
            return arrays[value[_ARRAY]]
        if value.keys() == {_TUPLE}:
            return tuple(_restored(one, arrays) for one in value[_TUPLE])
        return {key: _restored(one, arrays) for key, one in value.items()}
    return value


@dataclass
class Inbox:
    """Gathers the bytes that come through one pipe until a message is whole."""

    descriptor: int
    """The reading end; it must not block."""
    _bytes: bytearray = field(default_factory=bytearray)

    def read(self) -> bool:
        """Take what is there; return False once nothing will ever come again."""
        while True:
            try:
                piece = os.read(self.descriptor, 2**20)
            except BlockingIOError:
                return True
            except OSError:  # the other end was closed before it had read all
                return False
            if not piece:
                return False
            self._bytes += piece

    def message(self) -> dict[str, Any] | None:
        """Return the first whole message, or None.

        Raises
        ------
        ValueError
            If what came is no message of `pack`, as soon as its header is there.
        """
        if len(self._bytes) < _HEADER.size:
            return None
        magic, text, arrays = _HEADER.unpack_from(self._bytes)
        if magic != _MAGIC or text + arrays > MOST_BYTES:
            raise ValueError("the bytes do not begin with the length of a result")
        middle, end = _HEADER.size + text, _HEADER.size + text + arrays
        if len(self._bytes) < end:
            return None
        message = _read(bytes(self._bytes[_HEADER.size : middle]), bytes(self._bytes[middle:end]))
        del self._bytes[:end]
        return message


def unpack(content: bytes) -> dict[str, Any]:
    """Return the message that `pack` made into `content`; raises ValueError if it is none."""
    if len(content) < _HEADER.size or not content.startswith(_MAGIC):
        raise ValueError("it does not begin as a message")
    middle = _HEADER.size + _HEADER.unpack_from(content)[1]
    return _read(content[_HEADER.size : middle], content[middle:])


def _read(text: bytes, arrays: bytes) -> dict[str, Any]:
    loaded: list[npt.NDArray[Any]] = []
    content = BytesIO(arrays)
    try:
        while content.tell() < len(arrays):
            import numpy as np

            loaded.append(np.load(content, allow_pickle=False))
        message = _restored(json.loads(text), loaded)
    except Exception as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error
    if not isinstance(message, dict):
        raise ValueError(f"a {type(message).__name__} came")
    return message


def dump_error(error: BaseException) -> dict[str, Any]:
    """Return an exception as text; `kind` is the name of its class if that is one of `tactbench.core.errors`."""
    where = "".join(traceback.format_exception(error))
    name = type(error).__name__
    if isinstance(error, TactbenchError) and getattr(errors, name, None) is type(error):
        fields: dict[str, Any] = {
            "kind": name,
            "message": str(error.message),
            "hint": str(error.hint),
            "traceback": str(error.traceback_text) or where,
        }
        if isinstance(error, CellStopped):
            fields |= {"signal": error.signal, "log": error.log, "spent_s": error.spent_s}
        return fields
    try:
        text = str(error)
    except Exception:
        text = "(its text cannot be read)"
    return {"kind": "", "message": f"{name}: {text}", "hint": "", "traceback": where}


def load_error(fields: Mapping[str, Any], log: str = "") -> TactbenchError:
    """Return the exception that `dump_error` made text of; `log` is what was printed, if the text does not hold it."""
    kind = getattr(errors, fields["kind"], None) if fields["kind"] else Raised
    if not (isinstance(kind, type) and issubclass(kind, TactbenchError)):
        raise ValueError(f"there is no error called {fields['kind']!r}")
    error = _rebuild(kind, fields["message"], fields["hint"])
    error.traceback_text = fields["traceback"]
    if isinstance(error, CellStopped):
        error.signal, error.log = fields.get("signal"), fields.get("log") or log
        error.spent_s = fields.get("spent_s")
    return error
