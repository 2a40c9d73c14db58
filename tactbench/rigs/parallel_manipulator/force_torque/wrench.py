"""What force-torque sensors have in common: their stream, what moves their emulators."""

from __future__ import annotations

from collections.abc import Mapping

from tactbench.plugin import ChannelSpec, StreamSpec

AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
STREAM = "force_torque"


def stream(rate_hz: float | None) -> StreamSpec:
    """Return the stream of forces [N] and torques [N*m] in the sensor's own axes."""
    channels = tuple(
        ChannelSpec(name=name, kind="force", unit="N")
        if name.startswith("f")
        else ChannelSpec(name=name, kind="torque", unit="N*m")
        for name in AXES
    )
    return StreamSpec(name=STREAM, rate_hz=rate_hz, channels=channels)


def wrench_of(senses: Mapping[str, float]) -> tuple[float, ...]:
    """Return fx, fy, fz [N], tx, ty, tz [N*m]; those that `senses` leaves out are 0."""
    return tuple([senses.get(name, 0.0) for name in AXES])
