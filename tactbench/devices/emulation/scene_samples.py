"""Samples of one simulated scene, read by emulated devices as their sensed values."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence

from tactbench.core.samples import Block, join_blocks
from tactbench.core.spec.sensor import StreamSpec

PRESSING_FORCE = "fz"
"""Channel name of the force on the sensor in simulated rigs [N], positive when pressing."""


class SceneSamples:
    """A scene as :data:`~tactbench.devices.emulator.Senses`: each channel's latest sample up to a given time.

    Each channel holds its value until its next sample, so that the samples of sensor and force sensor stay as
    simultaneous as they were simulated. Before and after the scene nothing is pressed: the samples of its first
    `rest_s` seconds, before pressing began, repeat, offsets and noise included. :meth:`start` begins the scene.

    Parameters
    ----------
    streams
        Streams of the sensor and the force sensor.
    blocks
        Their blocks, with times in nanoseconds since the begin of the scene.
    duration_s
        Length of the scene [s].
    rest_s
        Length of the scene's unloaded beginning [s]; 0: only the first sample is held.
    """

    def __init__(
        self, streams: Sequence[StreamSpec], blocks: Iterable[Block], duration_s: float, *, rest_s: float = 0.0
    ) -> None:
        self._end_ns, self._rest_ns = round(1e9 * duration_s), round(1e9 * min(rest_s, duration_s))
        self._start_s: float | None = None
        came, self._tracks = list(blocks), []
        for stream in streams:
            own = [block for block in came if block.stream == stream.name]
            if own and (whole := join_blocks(own)).t_ns is not None:
                names = tuple(channel.name for channel in stream.channels)
                self._tracks.append((whole.t_ns.tolist(), names, whole.data.tolist()))
        self._last: tuple[tuple[int, ...], Mapping[str, float]] = (), {}

    def start(self, at_s: float) -> None:
        """Let the scene begin at `at_s` on the devices' clock; a scene may be begun several times."""
        self._start_s = at_s

    def __call__(self, t_s: float) -> Mapping[str, float]:
        """Return the value of every channel, in its unit, at the time `t_s` of the devices' clock [s]."""
        since_ns = round(1e9 * (t_s - (self._start_s or 0.0)))
        if self._start_s is None or not 0 <= since_ns < self._end_ns:
            since_ns = since_ns % self._rest_ns if self._rest_ns else 0
        rows = tuple(max(bisect_right(times, since_ns) - 1, 0) for times, _, _ in self._tracks)
        if rows != self._last[0]:
            found: dict[str, float] = {}
            for row, (_, names, samples) in zip(rows, self._tracks, strict=True):
                found.update(zip(names, samples[row], strict=True))
            self._last = rows, found
        return self._last[1]
