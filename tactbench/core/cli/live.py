"""The line that ``record --live`` shows on the terminal: force, planned force, and mean rates of the streams."""

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


class LiveView:
    """A line on stderr during a recording, if `drawn`; its last state stays at the end of the ``with`` block.

    `acquire` calls :meth:`begin` and :meth:`watch`. A separate thread draws, so that a slow terminal delays
    no recording.
    """

    def __init__(self, scene: Scene, title: str, *, drawn: bool = True) -> None:
        from rich.console import Console

        self.line = f"{title}: waiting for samples"
        """The line as it was last updated."""
        self._scene = scene
        self._title = title
        self._drawn = drawn
        self._status = Console(stderr=True, highlight=False).status(self.line)
        self._streams: dict[str, StreamSpec] = {}
        self._rows = Counter[str]()
        self._force = "-"
        self._began_ns = self._last_ns = 0

    def begin(self, acquisition: Acquisition) -> None:
        """Start drawing the line for the streams of `acquisition`."""
        self._streams = {spec.name: spec for spec in (*acquisition.streams, *acquisition.reference)}
        if self._drawn:
            self._status.start()

    def watch(self, block: Block) -> None:
        """Count the rows of a block, note its newest force, and update the line; no reference to the block is kept."""
        import numpy as np
        from rich.text import Text

        from tactbench.core.spec import units

        if not self._drawn or block.stream not in self._streams or block.t_ns is None or not len(block.t_ns):
            return
        if not self._rows:
            self._began_ns = int(block.t_ns[0])
        self._rows[block.stream] += len(block.data)
        self._last_ns = max(self._last_ns, int(block.t_ns[-1]))
        for column, channel in enumerate(self._streams[block.stream].channels):
            if channel.kind == "force" and channel.name in ("normal", "fz"):
                self._force = f"{block.data[-1, column] * units.conversion(channel.unit, 'N'):.2f}"
        profile, elapsed_s = self._scene.profile, (self._last_ns - self._began_ns) * 1e-9
        rates = [f"{name} {elapsed_s and self._rows[name] / elapsed_s:.4g} Hz" for name in self._streams]
        self.line = (
            f"{self._title}: {elapsed_s:.1f} of {profile.duration.to('s'):.1f} s, force {self._force} N, planned "
            f"{np.interp(elapsed_s, *profile.corners):.2f} N; {', '.join(rates)}"
        )
        self._status.update(Text(self.line))

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Return a context in which the line is hidden, so that a prompt can use the terminal."""
        self._status.stop()
        try:
            yield
        finally:
            if self._streams and self._drawn:
                self._status.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._status.stop()
        if self._drawn:
            remark(self.line)
