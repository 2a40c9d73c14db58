"""The line that ``record --live`` shows on the terminal: force beside the planned force, and rates of the streams."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Self

from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from tactbench.core.plugins.interfaces import Acquisition
    from tactbench.core.samples import Block
    from tactbench.core.spec.scene import Scene
    from tactbench.core.spec.sensor import StreamSpec

PERIOD_S = 0.5
"""Recorded time between two updates of the line, over which rates are computed [s]."""


class LiveView:
    """A line on stderr during a recording; a line of the whole recording stays at the end of the ``with`` block.

    `acquire` calls :meth:`begin` and :meth:`watch`. A separate thread draws, so that a slow terminal delays
    no recording.
    """

    def __init__(self, scene: Scene, title: str) -> None:
        from rich.console import Console

        self.line = f"{title}: waiting for samples"
        """The line as it was last updated."""
        self._scene = scene
        self._title = title
        self._status = Console(stderr=True, highlight=False).status(self.line)
        self._streams: dict[str, StreamSpec] = {}
        self._rows, self._shown = Counter[str](), Counter[str]()  # until now, and at the last update
        self._force = "-"
        self._began_ns = self._shown_ns = self._last_ns = 0

    def begin(self, acquisition: Acquisition) -> None:
        """Start drawing the line for the streams of `acquisition`."""
        self._streams = {spec.name: spec for spec in (*acquisition.streams, *acquisition.reference)}
        self._status.start()

    def watch(self, block: Block) -> None:
        """Count the rows of a block and note its newest force; no reference to the block is kept."""
        from tactbench.core.spec import units

        if block.stream not in self._streams or block.t_ns is None or not len(block.t_ns):
            return
        if not self._rows:
            self._began_ns = self._shown_ns = int(block.t_ns[0])
        self._rows[block.stream] += len(block.data)
        self._last_ns = max(self._last_ns, int(block.t_ns[-1]))
        for column, channel in enumerate(self._streams[block.stream].channels):
            if channel.kind == "force" and channel.name in ("normal", "fz"):
                self._force = f"{block.data[-1, column] * units.conversion(channel.unit, 'N'):.2f}"
        if self._last_ns - self._shown_ns >= PERIOD_S * 1e9:
            self._update()

    def _update(self) -> None:
        """Compute the line anew, with the rates since its last update."""
        import numpy as np
        from rich.text import Text

        profile, elapsed_s = self._scene.profile, (self._last_ns - self._began_ns) * 1e-9
        planned_n, since_s = np.interp(elapsed_s, *profile.corners), (self._last_ns - self._shown_ns) * 1e-9
        rates = [f"{name} {(self._rows[name] - self._shown[name]) / since_s:.4g} Hz" for name in self._streams]
        self.line = (
            f"{self._title}: {elapsed_s:.1f} of {profile.duration.to('s'):.1f} s, force {self._force} N, planned "
            f"{planned_n:.2f} N; {', '.join(rates)}"
        )
        self._shown, self._shown_ns = self._rows.copy(), self._last_ns
        self._status.update(Text(self.line))

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Return a context in which the line is hidden, so that a prompt can use the terminal."""
        self._status.stop()
        try:
            yield
        finally:
            if self._streams:
                self._status.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Show the line of the whole recording, with mean rates."""
        self._status.stop()
        if self._last_ns > self._began_ns:
            self._shown.clear()
            self._shown_ns = self._began_ns
            self._update()
        remark(self.line)
