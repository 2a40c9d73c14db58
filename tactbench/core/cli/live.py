"""The live view of ``record --live``: force, taxels and rates on the terminal while a recording is made."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Self

from tactbench.core.samples import Quality
from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

    from tactbench.core.plugins.interfaces import Acquisition
    from tactbench.core.samples import Block
    from tactbench.core.spec.scene import Scene
    from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

SILENT_S = 2.0
"""Seconds without data after which a stream is reported as silent."""
BAR = 8
"""Length of the longest bar drawn for a taxel [characters]."""


class StreamState:
    """State of a stream during a recording: its newest samples, and counts of its rows.

    One thread calls :meth:`take`; another may read the attributes meanwhile, since each is replaced as a whole.

    Attributes
    ----------
    rows, bad, lost
        Rows received; rows with a missing, suspect or saturated sample; rows missing by the device's sequence numbers.
    first, latest
        (channels,) first and newest sample of each channel that was not missing, in the channel's unit; NaN if none.
    span_ns
        Times of the first and the newest row [ns].
    rate_hz
        Mean rate since the first row [Hz].
    seen_s
        Arrival time of the newest block of rows [s of `time.monotonic`].
    """

    def __init__(self, spec: StreamSpec) -> None:
        self.spec = spec
        self.rows = self.bad = self.lost = 0
        self.first: Any = None
        self.latest: Any = None
        self.span_ns: tuple[int, int] | None = None
        self.rate_hz: float | None = None
        self.seen_s = 0.0
        self._begin: tuple[int, int] | None = None
        self._first_number: int | None = None

    def take(self, block: Block) -> None:
        """Count the rows of a block of samples, and keep its newest samples."""
        import numpy as np

        if not len(block.data):
            return
        before, self.rows = self.rows, self.rows + len(block.data)
        values = np.array(block.data[[0, -1]], dtype=float)
        if block.quality is not None:
            values[(block.quality[[0, -1]] & Quality.MISSING) != 0] = np.nan
            self.bad += int(((block.quality & ~Quality.GAP) != 0).any(axis=1).sum())
        first, latest = values if self.first is None else (self.first, self.latest)
        self.first = np.where(np.isnan(first), values[0], first)
        self.latest = np.where(np.isnan(values[1]), latest, values[1])
        if block.sequence is not None:
            if self._first_number is None:
                self._first_number = int(block.sequence[0]) - before
            self.lost = max(0, int(block.sequence[-1]) - self._first_number + 1 - self.rows)
        if block.t_ns is not None:
            first_ns, last_ns = int(block.t_ns[0]), int(block.t_ns[-1])
            if self._begin is None:  # the rows of a block that have one time count as one
                self._begin = (first_ns, 1) if last_ns > first_ns else (last_ns, self.rows)
            begin_ns, rows = self._begin
            self.span_ns = begin_ns, last_ns
            self.rate_hz = (self.rows - rows) / (last_ns - begin_ns) * 1e9 if last_ns > begin_ns else None
        self.seen_s = time.monotonic()

    def values(self) -> Iterator[tuple[ChannelSpec, float, float]]:
        """Yield each channel with its first and its newest sample."""
        if self.latest is not None:
            yield from zip(self.spec.channels, self.first.tolist(), self.latest.tolist(), strict=True)


class LiveView:
    """Live view, on stderr, of a recording in progress, from the start of its streams to the end of the ``with`` block.

    `acquire` calls :meth:`begin` and :meth:`watch`. A separate thread draws, so that a slow terminal delays
    no recording.
    """

    def __init__(self, scene: Scene, title: str) -> None:
        from rich.console import Console
        from rich.live import Live

        self._scene = scene
        self._title = title
        self._states: dict[str, StreamState] = {}
        self._reference: tuple[StreamSpec, ...] = ()
        self._ended = False
        self._console = Console(stderr=True, highlight=False)
        self._live: Live | None = None
        if self._console.is_terminal and not self._console.is_dumb_terminal:
            self._live = Live(
                get_renderable=self.picture, console=self._console, screen=True, refresh_per_second=10,
                redirect_stdout=False, redirect_stderr=False,
            )  # fmt: skip
        else:
            remark("stderr is not a terminal that --live can draw on: no live view is shown.")

    def begin(self, acquisition: Acquisition) -> None:
        """Start drawing the streams of `acquisition`."""
        self._reference = acquisition.reference
        self._states = {spec.name: StreamState(spec) for spec in (*acquisition.streams, *acquisition.reference)}
        if self._live is not None:
            self._live.start()

    def watch(self, block: Block) -> None:
        """Copy the newest samples of a block; no reference to the block is kept."""
        if block.stream in self._states:
            self._states[block.stream].take(block)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Return a context in which drawing is suspended, so that a prompt can use the terminal."""
        live = self._live if self._live is not None and self._live.is_started else None
        if live is not None:
            live.stop()
        try:
            yield
        finally:
            if live is not None:
                live.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the terminal, and print the last state of the view on it."""
        if self._live is not None and self._states:
            self._live.stop()
            self._ended = True
            self._console.print(self.picture())

    def picture(self) -> RenderableType:
        """Return the view of the present state; lines beyond the height of the terminal are cut off."""
        from rich.columns import Columns
        from rich.console import Group
        from rich.text import Text

        values = [value for one in self._states.values() if one.spec not in self._reference for value in one.values()]
        changes = [(channel, latest - first) for channel, first, latest in values if channel.kind == "taxel"]
        full = max((abs(change) for _, change in changes if change == change), default=0.0)
        others = [
            f"{channel.name} {latest:.5g} {channel.unit}" for channel, _, latest in values if channel.kind != "taxel"
        ]
        parts: list[RenderableType] = [Text(f"{self._title}: {self._course()}", "bold"), *self._counts()]
        if others:
            parts.append(Text("   ".join(others), overflow="ellipsis"))
        if changes:
            unit = changes[0][0].unit
            parts.append(Text(f"{len(changes)} taxels: change since start [{unit}]; full bar {full:.3g}", "dim"))
            parts.append(Columns([_taxel(*one, full) for one in changes], padding=(0, 2), column_first=True))
        return Group(*parts)

    def _course(self) -> str:
        """Return the text with the time since the first sample, and the measured and the planned force [N]."""
        import numpy as np

        from tactbench.core.spec import units

        spans = [state.span_ns for state in self._states.values() if state.span_ns is not None]
        if not spans:
            return "waiting for samples"
        elapsed_s = (max(last for _, last in spans) - min(first for first, _ in spans)) * 1e-9
        forces = [
            (channel.name not in ("normal", "fz"), f"{latest * units.conversion(channel.unit, 'N'):.2f}")
            for spec in self._reference
            for channel, _, latest in self._states[spec.name].values()
            if channel.kind == "force"
        ]
        force = min(forces, key=lambda one: one[0], default=(True, "-"))[1]
        wanted_n = np.interp(elapsed_s, *self._scene.profile.corners)
        duration_s = self._scene.profile.duration.to("s")
        return f"{elapsed_s:.1f} of {duration_s:.1f} s, force {force} N, wanted {wanted_n:.2f} N"

    def _counts(self) -> Iterator[Text]:
        """Yield one line of counts for each stream, in red if the stream is silent or has lost or bad rows."""
        from rich.text import Text

        for name, state in self._states.items():
            silent_s = time.monotonic() - state.seen_s if state.rows and not self._ended else 0.0
            rates = " of ".join("-" if rate is None else f"{rate:.4g}" for rate in (state.rate_hz, state.spec.rate_hz))
            rate = f"silent for {silent_s:.0f} s" if silent_s >= SILENT_S else f"{rates} Hz"
            wrong = silent_s >= SILENT_S or state.lost or state.bad
            text = f"{name}: {state.rows} rows, {rate}, {state.lost} lost, {state.bad} bad"
            yield Text(text, "bold red" if wrong else "")


def _taxel(channel: ChannelSpec, change: float, full: float) -> Text:
    """Return the name, change and bar of a taxel; the change is signed so that load raises it, if the sign is known."""
    from rich.text import Text

    change *= channel.sign or 1
    bar = "━" * round(BAR * abs(change) / full) if full and change == change else ""
    return Text(f"{channel.name[:8]:<8} {change:>+8.4g} {bar:<{BAR}}", "cyan" if change >= 0 else "yellow")
