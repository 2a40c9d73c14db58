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
VERSION = 1
PARTIAL = ".partial"
"""Added to the name while a recording is being written."""

CHUNK_ROWS = 1024
MAX_META_BYTES = 16 * 2**20
"""A meta text larger than this is refused: files from strangers are data."""

NOT_CONTENT = {"provenance"}
"""Fields of the meta that are not part of the content digest: when and where it was written, at what cost."""


def meta_text(meta: RecordingMeta) -> str:
    """Return `meta` as canonical JSON."""
    return json.dumps(meta.model_dump(mode="json"), sort_keys=True, separators=(",", ":"), ensure_ascii=False)


class ContentDigest:
    """SHA-256 over what a recording says, whatever file, machine or library version holds it."""

    def __init__(self, meta: RecordingMeta) -> None:
        content = meta.model_dump(mode="json", exclude=NOT_CONTENT)
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
        self._sha = hashlib.sha256(f"{FORMAT} {VERSION}\n{text}\n".encode())

    def array(self, name: str, values: npt.NDArray[Any]) -> None:
        """Add an array by name, type, shape and little-endian bytes in row order."""
        if values.dtype.kind in "OSU":
            flat = "\0".join(str(value) for value in values.ravel())
            self._sha.update(f"{name} text {values.shape}\n".encode() + flat.encode())
            return
        plain = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
        self._sha.update(f"{name} {plain.dtype.str} {plain.shape}\n".encode())
        self._sha.update(plain.data)

    def hexdigest(self) -> str:
        """Return the digest so far."""
        return self._sha.hexdigest()


def specs_by_name(meta: RecordingMeta) -> dict[str, StreamSpec]:
    """Return the streams a recording may hold: the sensor's and the reference's."""
    return {stream.name: stream for stream in (*meta.sensor.streams, *meta.reference)}


def channel_attributes(spec: StreamSpec) -> Iterable[tuple[str, Any]]:
    """Yield the attributes that let an ordinary HDF5 viewer name and scale the columns."""
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
