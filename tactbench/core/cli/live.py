"""What is being recorded, while it is: on a terminal a screen drawn over and over, elsewhere a line now and then."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Self

from tactbench.core.cli.live_frame import Frame, force_text, losses_of, rate_text
from tactbench.core.cli.screen import remark
from tactbench.core.cli.stream_state import StreamState, Watched

if TYPE_CHECKING:
    from types import TracebackType

    from rich.console import Console

    from tactbench.core.plugins.interfaces import Acquisition, Rig
    from tactbench.core.samples import Block
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Scene

REFRESHES_PER_S = 10
"""At most; each sends a screen of characters, 2 kB at 80 x 24, which a slow connection still carries."""
LINE_S = 5.0
"""Seconds between two lines where stderr is no terminal."""


class LiveView:
    """Shows on stderr what is being recorded, from when the rig knows its streams to the end of the ``with`` block.

    Give the rig of :meth:`beside` and :meth:`watch` to `acquire`. It is drawn in a thread of its own: a slow terminal
    holds nothing back, and Ctrl-C comes amid no picture.

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
        self._watched: Watched | None = None
        self._console: Console | None = None
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def beside(self, rig: Rig) -> Rig:
        """Return a rig that does what `rig` does, and tells this view of its streams once they are known."""
        return _ObservedRig(rig, self)

    def begin(self, acquisition: Acquisition) -> None:
        """Begin to draw."""
        sensor = tuple(map(StreamState, acquisition.streams))
        reference = tuple(map(StreamState, acquisition.reference))
        self._watched = Watched(self._title, self._scene, sensor, reference)
        self._states = {state.spec.name: state for state in self._watched.streams}
        if sys.stderr.isatty() and os.environ.get("TERM", "").lower() not in ("dumb", "unknown"):
            from rich.console import Console

            # A way of its own to the terminal, whatever becomes of stderr meanwhile.
            terminal = os.fdopen(os.dup(sys.stderr.fileno()), "w", encoding="utf-8", errors="replace")
            self._console = Console(file=terminal, highlight=False)
        self._start()

    def watch(self, block: Block) -> None:
        """Remember the newest of a block: no waiting, no drawing, no reference to the block is kept."""
        state = self._states.get(block.stream)
        if state is not None:
            state.take(block)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave the terminal alone for a while, for somebody who is asked something."""
        was_drawing = self._thread is not None
        self._stop()
        try:
            yield
        finally:
            if was_drawing:
                self._start()

    def _start(self) -> None:
        self._over.clear()
        self._thread = threading.Thread(target=self._draw, name="live view")
        self._thread.start()

    def _stop(self) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _draw(self) -> None:
        """Draw until it is over: on the terminal's second screen, or a line now and then."""
        assert self._watched is not None
        if self._console is None:
            while not self._over.wait(LINE_S):
                remark(one_line(self._watched))
            return
        from rich.live import Live

        frame = Frame(self._watched)
        with Live(frame, console=self._console, screen=True, auto_refresh=False, redirect_stdout=False,
                  redirect_stderr=False) as live:  # fmt: skip
            while not self._over.wait(1 / REFRESHES_PER_S):
                live.refresh()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Leave the terminal as it was, and the last state on it."""
        self._stop()
        if self._watched is None:
            return
        if self._console is None:
            remark(one_line(self._watched))
            return
        with self._console.file:
            self._console.print(Frame(self._watched), end="")


class _ObservedRig:
    """A rig that tells a view of what it opens."""

    def __init__(self, rig: Rig, view: LiveView) -> None:
        self._rig = rig
        self._view = view

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[Acquisition]:
        with self._rig.open(sensor, scene, seed=seed) as acquisition:
            self._view.begin(acquisition)
            yield acquisition


def one_line(watched: Watched) -> str:
    """Return time, force, rates and losses in a line."""
    elapsed_s = watched.elapsed_s
    texts = ["no times yet" if elapsed_s is None else f"{elapsed_s:.1f} of {watched.duration_s:.1f} s"]
    if watched.force() is not None:
        texts.append(f"force {force_text(watched)}")
    for state in watched.streams:
        lost = losses_of(state)
        texts.append(f"{state.spec.name} {rate_text(state)} Hz" + (f" ({lost})" if lost else ""))
    return f"{watched.title}: {'; '.join(texts)}"
