"""Check of a recording from devices for missing data: silent streams, frozen readings, lost rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

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
        self._sensor = [stream.name for stream in sensor]
        self._specs = {stream.name: stream for stream in (*sensor, *reference)}
        self._rows: dict[str, list[IntArray]] = {name: [] for name in self._specs}
        """Of each block, for its rows with a sample: the times of the rows [ns], the times of the rows before [ns], and
        1 where the samples differ from those of the row before, (3, n)."""
        self._last: dict[str, tuple[int, Array]] = {}
        self._force: list[tuple[int, float]] = []
        self._times_ns: list[int] = []

    def add(self, block: Block) -> None:
        """Add a block of samples; a block without times is ignored."""
        stream, t_ns = block.stream, block.t_ns
        if stream not in self._specs or t_ns is None or not len(t_ns):
            return
        self._times_ns += int(t_ns[0]), int(t_ns[-1])
        missing = np.isnan(block.data.astype(np.float64))
        if block.quality is not None:
            missing |= (block.quality & np.uint8(Quality.MISSING)) != 0
        pressing = [place for place, one in enumerate(self._specs[stream].channels) if one.name in ("fz", "normal")]
        for place in pressing[:1] if stream not in self._sensor else ():
            forces = block.data[~missing[:, place], place]
            self._force += [(int(t_ns[-1]), float(forces.mean()))] if len(forces) else []
        good = ~missing.all(axis=1)
        if good.any():
            data, t_ns = block.data[good], t_ns[good]
            last_ns, last = self._last.get(stream, (t_ns[0], data[0]))
            changed = (data != np.vstack((last, data[:-1]))).any(axis=1)
            self._rows[stream].append(np.stack((t_ns, np.append(last_ns, t_ns[:-1]), changed)))
            self._last[stream] = int(t_ns[-1]), data[-1].copy()

    @property
    def seconds(self) -> float:
        """Time between the first and the last row of all streams, by their time stamps [s]."""
        return 1e-9 * (max(self._times_ns, default=0) - min(self._times_ns, default=0))

    def lacking(self, counts: Mapping[str, StreamCounts]) -> list[str]:
        """Return sentences about streams that exceed a limit; `counts` are the rig's counts of rows, by stream."""
        return [text for name in self._specs for text in self._of(name, counts.get(name))]

    def _of(self, name: str, counts: StreamCounts | None) -> Iterator[str]:
        first_ns, last_ns = min(self._times_ns, default=0), max(self._times_ns, default=0)

        def for_long(what: str, from_ns: int, to_ns: int) -> str:
            return f"{name}: {what} for {1e-9 * (to_ns - from_ns):.3g} s from {1e-9 * (from_ns - first_ns):.3g} s on"

        edges = np.concatenate(([first_ns], self._kept(name)[0], [last_ns]))
        place = int(np.argmax(np.diff(edges)))
        if self._specs[name].rate_hz is not None and np.diff(edges)[place] > 1e9 * self._allowed.silent_s:
            yield for_long("silent", edges[place], edges[place + 1])
        # A microphone may be still in a slow press: the streams of the sensor count together.
        kept = self._kept(*(self._sensor if name in self._sensor else [name]))
        changes = kept[:, kept[2] == 1]
        since, until = np.append(kept[0, :1], changes[0]), np.append(changes[1], kept[0, -1:])
        for row in np.flatnonzero(until - since > 1e9 * self._allowed.frozen_s):
            if self._frozen(name, changes.shape[1], since[row], until[row]):
                yield for_long("frozen", since[row], until[row])
                break
        if counts is not None:
            lost, due = counts.gaps - counts.late + counts.dropped, counts.received + counts.gaps - counts.late
            if due and lost / due > 0.01 * self._allowed.lost_percent:
                yield f"{name}: {lost} of {due} rows lost"

    def _kept(self, *names: str) -> IntArray:
        """Return the rows of some streams as `_rows` describes them, in order of time, (3, n)."""
        blocks = (block for name in names for block in self._rows[name])
        rows = np.concatenate([np.empty((3, 0), dtype=np.int64), *blocks], axis=1)
        return rows[:, np.argsort(rows[0], kind="stable")]

    def _frozen(self, name: str, changes: int, from_ns: int, to_ns: int) -> bool:
        """Return True if a sensor is constant while the force changes, or a usually changing force sensor is."""
        if name in self._sensor:
            every = [value for _, value in self._force]
            within = [value for at_ns, value in self._force if from_ns <= at_ns <= to_ns]
            return bool(within) and max(within) - min(within) > MOVED * (max(every) - min(every)) > 0
        # An axis may stand; a force that nothing changes is none.
        if all(channel.kind != "force" for channel in self._specs[name].channels):
            return False
        if not changes:
            return bool(self._kept(*self._sensor)[2].any())
        others = self._kept(name).shape[1] * (1 - 1e-9 * (to_ns - from_ns) / self.seconds)
        return bool(changes > others / 2)
