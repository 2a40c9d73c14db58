"""What is being recorded, while it is: on a terminal a screen drawn over and over, elsewhere a line now and then."""

from __future__ import annotations

import os
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from tactbench.core.cli.screen import remark
from tactbench.core.samples import Block, Quality

if TYPE_CHECKING:
    from types import TracebackType

    from tactbench.core.plugins.interfaces import Acquisition, Rig
    from tactbench.core.samples import FloatArray
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Scene
    from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

REFRESHES_PER_S = 10
"""At most; each sends a screen of characters, 2 kB at 80 x 24, which a slow connection still carries."""
LINE_S = 5.0
"""Seconds between two lines where stderr is no terminal."""
LEVEL_S = 0.5
"""Seconds from a stream's first sample whose mean is its channels' level."""
RATE_S = 2.0
"""Seconds over which a rate is measured."""
COUNTED = (Quality.GAP, Quality.MISSING, Quality.SUSPECT, Quality.SATURATED)


class StreamState:
    """What is known of one stream so far.

    One thread calls :meth:`take`; another may read the attributes meanwhile: each is replaced as a whole, none is
    changed in place.

    Attributes
    ----------
    latest
        (channels,) the last sample of each channel that was not MISSING; NaN where there was none. None: no sample yet.
    quality
        (channels,) of the last sample.
    level
        (channels,) mean over the first :data:`LEVEL_S` seconds.
    largest
        (channels,) largest distance from the level among the last samples of all blocks.
    rate_hz
        Over the last :data:`RATE_S` seconds, or over the last block if that is longer. None: not known.
    first_ns, last_ns
        Of the first and the last sample, as the blocks have them.
    seen_s
        When the last block came [s of `time.monotonic`].
    counts
        Rows with a sample that has the mark.
    lost
        Rows that never came, by the device's numbers.
    """

    def __init__(self, spec: StreamSpec) -> None:
        self.spec = spec
        self.rows = 0
        self.latest: FloatArray | None = None
        self.quality: Any = None
        self.level: FloatArray | None = None
        self.largest: FloatArray | None = None
        self.rate_hz: float | None = None
        self.first_ns: int | None = None
        self.last_ns: int | None = None
        self.seen_s: float | None = None
        self.counts = dict.fromkeys(COUNTED, 0)
        self.lost = 0
        self._first_number: int | None = None
        self._levelled = False
        self._sums: tuple[Any, Any] = (0.0, 0)
        self._ends: deque[tuple[int, int]] = deque()

    def take(self, block: Block) -> None:
        """Remember what the block says: its last row, and counts over its rows."""
        import numpy as np

        if not len(block.data):
            return
        self._take_times(block)
        row = np.array(block.data[-1], dtype=float)
        if block.quality is not None:
            marks = np.bitwise_or.reduce(block.quality, axis=1)
            found = {flag: int(np.count_nonzero(marks & flag)) for flag in COUNTED}
            self.counts = {flag: self.counts[flag] + found[flag] for flag in COUNTED}
            before = np.full(len(row), np.nan) if self.latest is None else self.latest
            row = np.where(block.quality[-1] & Quality.MISSING, before, row)
            self.quality = block.quality[-1].copy()
        if not self._levelled:
            self._take_level(block)
        self.latest = row
        if self.level is not None:
            distance = np.abs(row - self.level)
            self.largest = distance if self.largest is None else np.fmax(self.largest, distance)
        self.seen_s = time.monotonic()

    def _take_times(self, block: Block) -> None:
        rows = len(block.data)
        if block.sequence is not None:
            if self._first_number is None:
                self._first_number = int(block.sequence[0]) - self.rows
            self.lost = max(0, int(block.sequence[-1]) - self._first_number + 1 - self.rows - rows)
        self.rows += rows
        if block.t_ns is None:
            return
        if self.first_ns is None:
            self.first_ns = int(block.t_ns[0])
        self.last_ns = int(block.t_ns[-1])
        if not self._ends and self.last_ns > self.first_ns:  # else all of it was received at once
            self._ends.append((self.first_ns, self.rows - rows + 1))
        self._ends.append((self.last_ns, self.rows))
        while len(self._ends) > 2 and self.last_ns - self._ends[1][0] >= RATE_S * 1e9:
            self._ends.popleft()
        began_ns, began_rows = self._ends[0]
        if self.last_ns > began_ns:
            self.rate_hz = (self.rows - began_rows) / (self.last_ns - began_ns) * 1e9

    def _take_level(self, block: Block) -> None:
        """Add rows of the first half second to the level; without times the first block is it."""
        import numpy as np

        rows = len(block.data)
        if block.t_ns is not None and self.first_ns is not None:
            rows = int(np.searchsorted(block.t_ns, self.first_ns + LEVEL_S * 1e9, side="right"))
        values = np.array(block.data[:rows], dtype=float)
        if block.quality is not None:
            values[(block.quality[:rows] & Quality.MISSING) != 0] = np.nan
        there = ~np.isnan(values)
        total, number = self._sums
        self._sums = total, number = total + np.where(there, values, 0.0).sum(axis=0), number + there.sum(axis=0)
        self.level = np.where(number > 0, total / np.maximum(number, 1), np.nan)
        self._levelled = rows < len(block.data) or block.t_ns is None


@dataclass(frozen=True)
class Watched:
    """A recording that is being made."""

    title: str
    scene: Scene
    sensor: tuple[StreamState, ...]
    reference: tuple[StreamState, ...]

    @property
    def streams(self) -> tuple[StreamState, ...]:
        """All of them."""
        return self.sensor + self.reference

    @property
    def elapsed_s(self) -> float | None:
        """Seconds from the first sample to the last one, by the samples' times; None: no times yet."""
        firsts = [state.first_ns for state in self.streams if state.first_ns is not None]
        lasts = [state.last_ns for state in self.streams if state.last_ns is not None]
        return (max(lasts) - min(firsts)) * 1e-9 if firsts and lasts else None

    @property
    def duration_s(self) -> float:
        """Seconds the scene lasts."""
        return self.scene.profile.duration.to("s")

    @property
    def wanted_n(self) -> float | None:
        """Force of the scene's profile at this time [N]; None: no time yet."""
        import numpy as np

        elapsed_s = self.elapsed_s
        return None if elapsed_s is None else float(np.interp(elapsed_s, *self.scene.profile.corners))

    def force(self) -> tuple[StreamState, int] | None:
        """Return the stream and the place of the reference force: `normal` or `fz`, else the first of its kind."""
        found = [
            (state, place)
            for state in self.reference
            for place, channel in enumerate(state.spec.channels)
            if channel.kind == "force"
        ]
        named = [one for one in found if channel_of(*one).name in ("normal", "fz")]
        return next(iter(named + found), None)


def channel_of(state: StreamState, place: int) -> ChannelSpec:
    """Return the channel at a place of a stream."""
    return state.spec.channels[place]


class LiveView:
    """Shows on stderr what is being recorded, from when the rig knows its streams to the end of the ``with`` block.

    Give the rig of :meth:`beside` and :meth:`watch` to `acquire`. Nothing is drawn in the thread that calls `watch`.

    Parameters
    ----------
    scene
        What is carried out.
    title
        What is shown at the top.
    """

    def __init__(self, scene: Scene, title: str) -> None:
        self._scene = scene
        self._title = title
        self._states: dict[str, StreamState] = {}
        self.watched: Watched | None = None
        self._drawing: _Drawing | None = None

    def beside(self, rig: Rig) -> Rig:
        """Return a rig that does what `rig` does, and tells this view of its streams once they are known."""
        return _Told(rig, self)

    def begin(self, acquisition: Acquisition) -> None:
        """Begin to draw."""
        sensor = tuple(map(StreamState, acquisition.streams))
        reference = tuple(map(StreamState, acquisition.reference))
        self.watched = Watched(self._title, self._scene, sensor, reference)
        self._states = {state.spec.name: state for state in self.watched.streams}
        self._drawing = _drawing_of(self.watched)
        self._drawing.start()

    def watch(self, block: Block) -> None:
        """Remember the newest of a block: no waiting, no drawing, no reference to the block is kept."""
        state = self._states.get(block.stream)
        if state is not None:
            state.take(block)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave the terminal alone for a while, for somebody who is asked something."""
        if self._drawing is None:
            yield
            return
        self._drawing.stop()
        try:
            yield
        finally:
            self._drawing.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._drawing is not None:
            self._drawing.stop()
            self._drawing.show_last()
            self._drawing = None


class _Told:
    """A rig that tells a view of what it opens."""

    def __init__(self, rig: Rig, view: LiveView) -> None:
        self._rig = rig
        self._view = view

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[Acquisition]:
        with self._rig.open(sensor, scene, seed=seed) as acquisition:
            self._view.begin(acquisition)
            yield acquisition


def _drawing_of(watched: Watched) -> _Drawing:
    """Return what fits stderr: a terminal that can move its cursor, or anything else."""
    if sys.stderr.isatty() and os.environ.get("TERM", "").lower() not in ("dumb", "unknown"):
        return _Screen(watched)
    return _Lines(watched)


class _Drawing(ABC):
    """Draws in a thread of its own: a slow terminal holds nothing back, and Ctrl-C comes amid no picture."""

    def __init__(self) -> None:
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        self._over.clear()
        self._thread = threading.Thread(target=self._draw, name="live view")
        self._thread.start()

    def stop(self) -> None:
        """Leave the terminal as it was; does nothing if that is done."""
        self._over.set()
        if self._thread is not None and self._thread.is_alive():
            self._thread.join()

    @abstractmethod
    def _draw(self) -> None:
        """Draw until it is over."""

    @abstractmethod
    def show_last(self) -> None:
        """Leave the last state behind, once stopped; the last call."""


class _Screen(_Drawing):
    """The terminal's second screen, which a change of its size leaves whole; the last state on the first one."""

    def __init__(self, watched: Watched) -> None:
        from rich.console import Console

        from tactbench.core.cli.live_frame import Frame

        super().__init__()
        # A way of its own to the terminal, whatever becomes of stderr meanwhile.
        self._terminal = os.fdopen(os.dup(sys.stderr.fileno()), "w", encoding="utf-8", errors="replace")
        self._console = Console(file=self._terminal, highlight=False)
        self._frame = Frame(watched)

    def _draw(self) -> None:
        from rich.live import Live

        with Live(
            self._frame, console=self._console, screen=True, auto_refresh=False, redirect_stdout=False,
            redirect_stderr=False,
        ) as live:  # fmt: skip
            while not self._over.wait(1 / REFRESHES_PER_S):
                live.refresh()

    def show_last(self) -> None:
        with self._terminal:
            self._console.print(self._frame)


class _Lines(_Drawing):
    """A line every few seconds."""

    def __init__(self, watched: Watched) -> None:
        super().__init__()
        self._watched = watched

    def _draw(self) -> None:
        while not self._over.wait(LINE_S):
            remark(one_line(self._watched))

    def show_last(self) -> None:
        remark(one_line(self._watched))


def one_line(watched: Watched) -> str:
    """Return time, force, rates and losses in a line."""
    from tactbench.core.cli.live_frame import force_text, losses_of, rate_text

    elapsed_s = watched.elapsed_s
    said = ["no times yet" if elapsed_s is None else f"{elapsed_s:.1f} of {watched.duration_s:.1f} s"]
    if watched.force() is not None:
        said.append(f"force {force_text(watched)}")
    for state in watched.streams:
        lost = losses_of(state)
        said.append(f"{state.spec.name} {rate_text(state)} Hz" + (f" ({lost})" if lost else ""))
    return f"{watched.title}: {'; '.join(said)}"
