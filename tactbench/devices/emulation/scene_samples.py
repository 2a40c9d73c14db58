"""What moves emulated devices: the samples of one scene that a simulated rig has carried out."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence

from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec

PRESSING_FORCE = "fz"
"""Name under which a simulated rig gives the force with which the sensor is pressed, positive when pressing [N]."""


class SceneSamples:
    """A scene as :data:`~tactbench.devices.emulator.Senses`: every channel's latest sample at or before a time.

    All channels are held from one sample to the next in the same way, so that the sensor's and the force sensor's stay
    as simultaneous as they were simulated. Before the scene begins and after it is over, nothing is pressed: the
    samples of its first `rest_s` seconds, before pressing began, come again and again, offsets and noise included.
    Until :meth:`start` was called, the scene has not begun.

    Parameters
    ----------
    streams
        The sensor's and the force sensor's.
    blocks
        Theirs, with times in nanoseconds since the scene's beginning.
    duration_s
        Its length.
    rest_s
        How long nothing is pressed at its beginning; 0: the first sample alone is held.
    """

    def __init__(
        self, streams: Sequence[StreamSpec], blocks: Iterable[Block], duration_s: float, *, rest_s: float = 0.0
    ) -> None:
        self.duration_s = duration_s
        self._rest_ns = round(1e9 * min(rest_s, duration_s))
        self._start_s: float | None = None
        self._tracks = _tracks(streams, blocks)
        self._last: tuple[tuple[int, ...], Mapping[str, float]] = (), {}

    def start(self, at_s: float) -> None:
        """Let the scene begin at `at_s` on the devices' clock; it may begin again."""
        self._start_s = at_s

    def __call__(self, t_s: float) -> Mapping[str, float]:
        """Return the value of every channel at `t_s`, seconds of the devices' clock, in the channels' units."""
        since_ns = round(1e9 * (t_s - (self._start_s or 0.0)))
        if self._start_s is None or not 0 <= since_ns < round(1e9 * self.duration_s):
            since_ns = since_ns % self._rest_ns if self._rest_ns else 0
        rows = tuple(max(bisect_right(times, since_ns) - 1, 0) for times, _, _ in self._tracks)
        last_rows, values = self._last
        if rows != last_rows:
            found: dict[str, float] = {}
            for row, (_, names, samples) in zip(rows, self._tracks, strict=True):
                found.update(zip(names, samples[row], strict=True))
            values = found
            self._last = rows, values
        return values


def _tracks(
    streams: Sequence[StreamSpec], blocks: Iterable[Block]
) -> list[tuple[list[int], tuple[str, ...], list[list[float]]]]:
    """Return times [ns], channels and rows of samples of each stream that has any."""
    import numpy as np

    found: dict[str, list[Block]] = {stream.name: [] for stream in streams}
    for block in blocks:
        if block.t_ns is not None:
            found[block.stream].append(block)
    return [
        (
            np.concatenate([block.t_ns for block in several if block.t_ns is not None]).tolist(),
            tuple(channel.name for channel in stream.channels),
            np.concatenate([block.data for block in several]).tolist(),
        )
        for stream in streams
        if (several := found[stream.name])
    ]
