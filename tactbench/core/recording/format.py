"""Names and rules of the file format; ``docs/format.md`` is the specification."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec

FORMAT = "tactbench-recording"
VERSION = 2
"""Written; every version from 1 on is read."""
PARTIAL = ".partial"
"""Added to the name while a recording is being made."""
COMPLETING = ".completing"
"""Added to the name while the finished file is written, moments before it is renamed."""

CHUNK_ROWS = 1024
MAX_META_CHARACTERS = 16 * 2**20
"""A longer meta text is refused: files from strangers are data."""
MAX_LISTED_CHANNELS = 1000
"""Streams with more channels have no channel attributes: an attribute of HDF5 holds 64 KiB. The meta has them all."""

NOT_CONTENT = ("provenance",)
"""Fields of the meta that are not part of the content digest: when and where it was written, at what cost."""


def canonical(content: Any) -> str:
    """Return plain data as canonical JSON; ValueError for NaN and infinity, which JSON does not have."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def meta_text(meta: RecordingMeta) -> str:
    """Return `meta` as canonical JSON."""
    return canonical(meta.model_dump(mode="json"))


class ContentDigest:
    """SHA-256 over what a recording says, whatever file, machine or library version holds it.

    Parameters
    ----------
    text
        The meta as it stands in the file: a model of a later version, with more fields, must not change the digest.
    version
        That of the file.
    """

    def __init__(self, text: str, version: int = VERSION) -> None:
        content = json.loads(text)
        for name in NOT_CONTENT:
            content.pop(name, None)
        self._sha = hashlib.sha256(f"{FORMAT} {version}\n{canonical(content)}\n".encode())

    def texts(self, name: str, values: npt.NDArray[np.str_]) -> None:
        """Add a column of texts by name and shape, as a JSON list."""
        self._sha.update(f"{name} text {values.shape}\n{canonical(values.tolist())}\n".encode())

    def numbers(
        self, name: str, dtype: np.dtype[Any], shape: tuple[int, ...], pieces: Iterable[npt.NDArray[Any]]
    ) -> None:
        """Add a column by name, type, shape and little-endian bytes in row order; `pieces` are its rows in order."""
        plain = dtype.newbyteorder("<")
        self._sha.update(f"{name} {plain.str} {shape}\n".encode())
        for piece in pieces:
            self._sha.update(np.ascontiguousarray(piece, dtype=plain).data)

    def hexdigest(self) -> str:
        """Return the digest so far."""
        return self._sha.hexdigest()


def specs_by_name(meta: RecordingMeta) -> dict[str, StreamSpec]:
    """Return the streams a recording may hold: the sensor's and the reference's."""
    return {stream.name: stream for stream in (*meta.sensor.streams, *meta.reference)}


def channel_attributes(spec: StreamSpec) -> Iterable[tuple[str, Any]]:
    """Yield the attributes that let an ordinary HDF5 viewer name and scale the columns."""
    if len(spec.channels) > MAX_LISTED_CHANNELS:
        return
    nan = float("nan")
    yield "channel_names", [channel.name for channel in spec.channels]
    yield "channel_kinds", [channel.kind for channel in spec.channels]
    yield "channel_units", [channel.unit for channel in spec.channels]
    yield "channel_lower", np.array([nan if c.lower is None else c.lower for c in spec.channels])
    yield "channel_upper", np.array([nan if c.upper is None else c.upper for c in spec.channels])
    yield "channel_scale", np.array([nan if c.scale is None else c.scale.value for c in spec.channels])
    yield "channel_signs", np.array([channel.sign for channel in spec.channels], dtype=np.int8)
    yield "channel_position_m", np.array([channel.position_m or (nan, nan, nan) for channel in spec.channels])


def partial_path(path: Path) -> Path:
    """Return where a recording lies while it is being written."""
    return path.with_name(path.name + PARTIAL)


def completing_path(path: Path) -> Path:
    """Return where the finished file of a recording lies until it is renamed."""
    return path.with_name(path.name + COMPLETING)
