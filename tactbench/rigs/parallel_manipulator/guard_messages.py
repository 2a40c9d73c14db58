"""Messages between a rig and its guard's process: lines of JSON one way and back, blocks of samples as bytes."""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from tactbench.plugin import Block

if TYPE_CHECKING:
    import numpy.typing as npt

    from tactbench.plugin.devices import Clock

_HEADER = struct.Struct("<IBBHI")
"""Bytes that follow, device, columns, channels, rows."""
_COLUMNS = (("t_ns", 1), ("quality", 2), ("sequence", 4), ("device_ns", 8))
FORCE, MOTOR = 0, 1


@dataclass(frozen=True)
class DeviceSettings:
    """One device that the guard opens."""

    driver: str
    """``module:build``."""
    link: str
    """Address."""
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ProcessSettings:
    """What a guard's process is told first."""

    motor: DeviceSettings
    force: DeviceSettings
    log: str
    """A file that events are added to, one line of JSON each."""
    clock_zero_ns: int = 0
    """``time.monotonic_ns()`` at zero of the rig's clock."""

    def clock(self) -> Clock:
        """Return the rig's clock, which every process on this machine can read."""
        return lambda: time.monotonic_ns() - self.clock_zero_ns

    def body(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self)

    @classmethod
    def of(cls, body: dict[str, Any]) -> Self:
        """Return what `body` says."""
        return cls(**{**body, "motor": DeviceSettings(**body["motor"]), "force": DeviceSettings(**body["force"])})


def encode_message(kind: str, body: dict[str, Any] | None = None) -> bytes:
    """Return one line."""
    return json.dumps([kind, body or {}]).encode() + b"\n"


class MessageReader:
    """Bytes into messages, cut anywhere."""

    def __init__(self) -> None:
        self._line = bytearray()

    def feed(self, data: bytes) -> list[tuple[str, dict[str, Any]]]:
        """Return the messages that `data` completes."""
        self._line += data
        *lines, rest = self._line.split(b"\n")
        self._line = bytearray(rest)
        found = []
        for line in lines:
            kind, body = json.loads(line)
            found.append((str(kind), dict(body)))
        return found


def encode_block(device: int, block: Block) -> bytes:
    """Return the bytes of a block of a device; its data become float64."""
    data = np.ascontiguousarray(block.data, dtype="<f8")
    columns, parts = 0, [data.tobytes()]
    for name, bit in _COLUMNS:
        values = getattr(block, name)
        if values is not None:
            columns |= bit
            parts.append(np.ascontiguousarray(values, dtype="u1" if name == "quality" else "<i8").tobytes())
    body = b"".join(parts)
    return _HEADER.pack(len(body), device, columns, data.shape[1], data.shape[0]) + body


class BlockReader:
    """Bytes into blocks, cut anywhere.

    Parameters
    ----------
    streams
        Names of the streams of force sensor and motor.
    """

    def __init__(self, streams: tuple[str, str]) -> None:
        self._streams = streams
        self._bytes = bytearray()

    def feed(self, data: bytes) -> Iterator[tuple[int, Block]]:
        """Yield device and block of what `data` completes."""
        self._bytes += data
        while len(self._bytes) >= _HEADER.size:
            length, device, columns, channels, rows = _HEADER.unpack_from(self._bytes)
            if len(self._bytes) < _HEADER.size + length:
                return
            body = bytes(self._bytes[_HEADER.size : _HEADER.size + length])
            del self._bytes[: _HEADER.size + length]
            at = 8 * rows * channels
            found: dict[str, npt.NDArray[Any] | None] = {name: None for name, _ in _COLUMNS}
            values = np.frombuffer(body, "<f8", rows * channels).reshape(rows, channels).copy()
            for name, bit in _COLUMNS:
                if columns & bit:
                    n = rows * channels if name == "quality" else rows
                    kind = np.dtype("u1") if name == "quality" else np.dtype("<i8")
                    column = np.frombuffer(body, kind, n, at).copy()
                    found[name] = column.reshape(rows, channels) if name == "quality" else column
                    at += n * kind.itemsize
            yield device, Block(stream=self._streams[device], data=values, **found)
