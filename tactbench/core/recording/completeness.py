"""Check whether a recording of devices holds all that its scene should give."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tactbench.core.recording.format import Array
from tactbench.core.samples import Block, IntArray, Quality
from tactbench.core.spec.recording import StreamCounts
from tactbench.core.spec.rig_file import Allowed
from tactbench.core.spec.sensor import StreamSpec

INCOMPLETE = "incomplete: "
"""Beginning of `excluded` in the meta of an incomplete recording."""
MOVED = 0.2
"""Share of the range of the force: a sensor is frozen if its readings stand still while the force changes by more
(assumed; a force sensor's noise is less, and a sensor that is not pressed need not change)."""


@dataclass
class _Track:
    """Silence and the last row of one stream; times are nanoseconds."""

    last_ns: int | None = None
    """Time of the last row with a number."""
    silence: tuple[int, int] = (0, 0)
    """Length and beginning of the longest time without one."""
    row: Array | None = None
    """The last row."""


@dataclass
class _Stillness:
    """Stretch of equal rows in a stream of the force sensor, or in all streams of the sensor together."""

    same: tuple[int, int, int] | None = None
    """Times of the last change and of the last row, and the number of equal rows since."""
    long: list[tuple[int, int, int]] = field(default_factory=list)
    """Former stretches that were longer than is allowed."""
    rows: int = 0
    changes: int = 0


class Completeness:
    """Search for silence, stillness and lost rows in the blocks of a recording.

    The force sensor is frozen where it stands still for longer than is allowed and most of its other rows differ from
    the one before; or if it never changes while the sensor does. One with a coarse display, which repeats rows also
    while it is loaded, may stand still without load.

    Parameters
    ----------
    allowed
        What may be missing.
    sensor, reference
        Streams of the sensor and of the force sensor. Silence is looked for in those that have a rate.
    """

    def __init__(self, allowed: Allowed, sensor: Sequence[StreamSpec], reference: Sequence[StreamSpec]) -> None:
        self._allowed = allowed
        self._reference = {stream.name: [one.name for one in stream.channels] for stream in reference}
        # An axis may stand; a force that nothing changes is none.
        self._forces = {one.name for one in reference if any(channel.kind == "force" for channel in one.channels)}
        self._rated = {stream.name for stream in (*sensor, *reference) if stream.rate_hz is not None}
        self._tracks = {stream.name: _Track() for stream in (*sensor, *reference)}
        of_sensor = _Stillness()  # a microphone may have nothing to say of a slow press
        self._still = {stream.name: of_sensor for stream in sensor} | {one.name: _Stillness() for one in reference}
        self._begin_ns: int | None = None
        self._end_ns = 0
        self._force: list[tuple[int, float]] = []

    def add(self, block: Block) -> None:
        """Add a block; one without times is ignored."""
        track = self._tracks.get(block.stream)
        if track is None or block.t_ns is None or not len(block.data):
            return
        first, last = int(block.t_ns[0]), int(block.t_ns[-1])
        self._begin_ns = first if self._begin_ns is None else min(self._begin_ns, first)
        self._end_ns = max(self._end_ns, last)
        missing = np.isnan(block.data.astype(np.float64))
        if block.quality is not None:
            missing |= (block.quality & np.uint8(Quality.MISSING)) != 0
        good = ~missing.all(axis=1)
        if good.any():
            self._silence(track, block.t_ns[good])
            self._stillness(track, self._still[block.stream], block.t_ns[good], block.data[good])
        names = self._reference.get(block.stream, [])
        pressing = next((place for place, name in enumerate(names) if name in ("fz", "normal")), None)
        if pressing is not None and (~missing[:, pressing]).any():
            self._force.append((last, float(block.data[~missing[:, pressing], pressing].mean())))

    def _silence(self, track: _Track, t_ns: IntArray) -> None:
        before = self._begin_ns if track.last_ns is None else track.last_ns
        steps = np.diff(t_ns, prepend=before or 0)
        longest = int(steps.argmax())
        track.silence = max(track.silence, (int(steps[longest]), int(t_ns[longest] - steps[longest])))
        track.last_ns = int(t_ns[-1])

    def _stillness(self, track: _Track, still: _Stillness, t_ns: IntArray, data: Array) -> None:
        row = data[0] if track.row is None else track.row
        changed = np.flatnonzero((data != np.concatenate((row[None], data[:-1]))).any(axis=1)).tolist()
        since_ns, seen_ns, rows = still.same or (int(t_ns[0]), int(t_ns[0]), 0)
        begin = 0
        for place in changed:
            seen_ns = max(seen_ns, int(t_ns[place - 1])) if place else seen_ns
            if seen_ns - since_ns > 1e9 * self._allowed.frozen_s:
                still.long.append((since_ns, seen_ns, rows + place - begin))
            since_ns, rows, begin = max(since_ns, int(t_ns[place])), 0, place
        track.row, still.same = data[-1].copy(), (since_ns, max(seen_ns, int(t_ns[-1])), rows + len(data) - begin)
        still.rows += len(data)
        still.changes += len(changed)

    @property
    def seconds(self) -> float:
        """Time from the first row to the last by the devices' clocks [s]."""
        return 1e-9 * (self._end_ns - (self._begin_ns or 0))

    def lacking(self, counts: Mapping[str, StreamCounts]) -> list[str]:
        """Return a sentence for each stream that lacks more than is allowed; `counts` are the rig's, by stream."""
        return [text for name, track in self._tracks.items() for text in self._of(name, track, counts.get(name))]

    def _of(self, name: str, track: _Track, counts: StreamCounts | None) -> Iterator[str]:
        begin_ns = self._begin_ns or 0
        last_ns = begin_ns if track.last_ns is None else track.last_ns
        silent_ns, from_ns = max(track.silence, (self._end_ns - last_ns, last_ns))
        if name in self._rated and silent_ns > 1e9 * self._allowed.silent_s:
            yield f"{name}: nothing for {1e-9 * silent_ns:.3g} s from {1e-9 * (from_ns - begin_ns):.3g} s on"
        still = self._still[name]
        for from_ns, to_ns, rows in (*still.long, *([still.same] if still.same else [])):
            if to_ns - from_ns <= 1e9 * self._allowed.frozen_s:
                continue
            dead = name in self._forces and self._dead(still, rows)
            if dead or (name not in self._reference and self._pressed(from_ns, to_ns)):
                yield f"{name}: frozen for {1e-9 * (to_ns - from_ns):.3g} s from {1e-9 * (from_ns - begin_ns):.3g} s on"
                break
        if counts is not None:
            lost, due = counts.gaps - counts.late + counts.dropped, counts.received + counts.gaps - counts.late
            if due and lost / due > 0.01 * self._allowed.lost_percent:
                yield f"{name}: {lost} of {due} rows lost"

    def _dead(self, still: _Stillness, rows: int) -> bool:
        """Return whether so many equal `rows` of a force sensor are too many in view of its other rows."""
        if not still.changes:
            return any(one.changes for name, one in self._still.items() if name not in self._reference)
        return still.changes > (still.rows - rows) / 2

    def _pressed(self, from_ns: int, to_ns: int) -> bool:
        """Return whether the force changed within a span of time."""
        every = [value for _, value in self._force]
        within = [value for at_ns, value in self._force if from_ns <= at_ns <= to_ns]
        return bool(within) and max(within) - min(within) > MOVED * (max(every) - min(every)) > 0
