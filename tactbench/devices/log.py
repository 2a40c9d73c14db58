"""What a device's own tools have logged, read as blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec


@dataclass(frozen=True)
class DeviceLog:
    """The contents of one log."""

    streams: tuple[StreamSpec, ...]
    """What `blocks` are of: the streams of the sensor's spec that the log has, perhaps with fewer channels."""
    blocks: Sequence[Block]
    """In time order within each stream."""
    clock: Literal["device", "host", "nominal", "none"]
    """Who made the times: the device, the host that wrote the log, row number by rate, or nobody."""
    started: str = ""
    """When the log was begun, as the file states it; empty if it does not."""
    remarks: tuple[str, ...] = ()
    """What a reader of a score from it must know."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """What was counted on the way in, by name."""
