"""Check of a recording from devices for missing data: silent streams, frozen readings, lost rows."""

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
"""Beginning of the text in the meta's field `excluded` of an incomplete recording."""
MOVED = 0.2
"""Share of the force's range: a sensor is frozen if its readings are constant while the force changes by more than it
(assumed; a force sensor's noise is less, and a sensor that is not pressed need not change)."""


@dataclass
class _Events:
    """Counter of a stream's events, with the pauses between events that are longer than allowed [ns]."""

    allowed_ns: float
    count: int = 0
    last_ns: int | None = None
    pauses: list[tuple[int, int]] = field(default_factory=list)
    """Beginning and end [ns] of each pause longer than `allowed_ns`."""

    def add(self, t_ns: IntArray, until_ns: IntArray, start_ns: int) -> None:
        """Add events at `t_ns` and the ends `until_ns` of the pauses before them; the first begins at `start_ns`."""
        self.last_ns = start_ns if self.last_ns is None else self.last_ns
        since_ns = np.concatenate(([self.last_ns], t_ns[:-1]))[: len(t_ns)]
        long = until_ns - since_ns > self.allowed_ns
        self.pauses += zip(since_ns[long].tolist(), until_ns[long].tolist(), strict=True)
        self.count += len(t_ns)
        self.last_ns = max(self.last_ns, int(t_ns.max(initial=self.last_ns)))


class Completeness:
    """Search for silent streams, frozen readings and lost rows in the blocks of a recording.

    The force sensor is frozen if its readings are constant for longer than allowed although most of its other rows
    differ from the row before, or if they never change while the tactile sensor's readings do. A force sensor with a
    coarse display, which repeats readings also under load, may be constant without load.

    Parameters
    ----------
    allowed
        Limits: longest silence, longest time without a change, and share of lost rows.
    sensor, reference
        Streams of the tactile sensor and of the force sensor. Only streams with a stated rate are checked for silence.
    """

    def __init__(self, allowed: Allowed, sensor: Sequence[StreamSpec], reference: Sequence[StreamSpec]) -> None:
        self._allowed = allowed
        self._reference = {stream.name: [one.name for one in stream.channels] for stream in reference}
        # An axis may stand; a force that nothing changes is none.
        self._forces = {one.name for one in reference if any(channel.kind == "force" for channel in one.channels)}
        self._rated = {stream.name for stream in (*sensor, *reference) if stream.rate_hz is not None}
        self._rows = {stream.name: _Events(1e9 * allowed.silent_s) for stream in (*sensor, *reference)}
        of_sensor = _Events(
            1e9 * allowed.frozen_s
        )  # a microphone may be still in a slow press: its streams count together
        self._changes = {stream.name: of_sensor for stream in sensor}
        self._changes |= {stream.name: _Events(1e9 * allowed.frozen_s) for stream in reference}
        self._row: dict[str, Array] = {}
        self._begin_ns: int | None = None
        self._end_ns = 0
        self._force: list[tuple[int, float]] = []

    def add(self, block: Block) -> None:
        """Add a block of samples; a block without times is ignored."""
        stream, t_ns = block.stream, block.t_ns
        if stream not in self._rows or t_ns is None or not len(t_ns):
            return
        self._begin_ns = int(t_ns[0]) if self._begin_ns is None else min(self._begin_ns, int(t_ns[0]))
        self._end_ns = max(self._end_ns, int(t_ns[-1]))
        missing = np.isnan(block.data.astype(np.float64))
        if block.quality is not None:
            missing |= (block.quality & np.uint8(Quality.MISSING)) != 0
        names = self._reference.get(stream, [])
        pressing = next((place for place, name in enumerate(names) if name in ("fz", "normal")), None)
        if pressing is not None and (~missing[:, pressing]).any():
            self._force.append((int(t_ns[-1]), float(block.data[~missing[:, pressing], pressing].mean())))
        good = ~missing.all(axis=1)
        if good.any():
            data, t_ns, rows = block.data[good], t_ns[good], self._rows[stream]
            before = np.concatenate((self._row.get(stream, data[:1]), data[:-1]))
            before_ns = np.concatenate(([t_ns[0] if rows.last_ns is None else rows.last_ns], t_ns[:-1]))
            changed = (data != before).any(axis=1)
            self._changes[stream].add(t_ns[changed], before_ns[changed], int(t_ns[0]))
            rows.add(t_ns, t_ns, self._begin_ns)
            self._row[stream] = data[-1:].copy()

    @property
    def seconds(self) -> float:
        """Time between the first and the last row of all streams, by their time stamps [s]."""
        return 1e-9 * (self._end_ns - (self._begin_ns or 0))

    def lacking(self, counts: Mapping[str, StreamCounts]) -> list[str]:
        """Return sentences about streams that exceed a limit; `counts` are the rig's counts of rows, by stream."""
        return [text for name in self._rows for text in self._of(name, counts.get(name))]

    def _of(self, name: str, counts: StreamCounts | None) -> Iterator[str]:
        begin_ns, rows, changes = self._begin_ns or 0, self._rows[name], self._changes[name]
        last_ns = begin_ns if rows.last_ns is None else rows.last_ns
        silences = [*rows.pauses, (last_ns, self._end_ns)]
        from_ns, to_ns = max(silences, key=lambda one: one[1] - one[0])
        if name in self._rated and to_ns - from_ns > rows.allowed_ns:
            yield f"{name}: silent for {1e-9 * (to_ns - from_ns):.3g} s from {1e-9 * (from_ns - begin_ns):.3g} s on"
        seen_ns = max((self._rows[one].last_ns or 0 for one in self._rows if self._changes[one] is changes), default=0)
        for from_ns, to_ns in [*changes.pauses, (seen_ns if changes.last_ns is None else changes.last_ns, seen_ns)]:
            if to_ns - from_ns > changes.allowed_ns and self._frozen(name, from_ns, to_ns):
                yield f"{name}: frozen for {1e-9 * (to_ns - from_ns):.3g} s from {1e-9 * (from_ns - begin_ns):.3g} s on"
                break
        if counts is not None:
            lost, due = counts.gaps - counts.late + counts.dropped, counts.received + counts.gaps - counts.late
            if due and lost / due > 0.01 * self._allowed.lost_percent:
                yield f"{name}: {lost} of {due} rows lost"

    def _frozen(self, name: str, from_ns: int, to_ns: int) -> bool:
        """Return True if a sensor is constant while the force changes, or a usually changing force sensor is."""
        if name not in self._reference:
            every = [value for _, value in self._force]
            within = [value for at_ns, value in self._force if from_ns <= at_ns <= to_ns]
            return bool(within) and max(within) - min(within) > MOVED * (max(every) - min(every)) > 0
        if name not in self._forces:
            return False
        changes = self._changes[name].count
        if not changes:
            return any(one.count for other, one in self._changes.items() if other not in self._reference)
        others = self._rows[name].count * (1 - 1e-9 * (to_ns - from_ns) / self.seconds)
        return changes > others / 2
