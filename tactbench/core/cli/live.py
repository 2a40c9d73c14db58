"""What is being recorded, while it is: on a terminal a screen of rich's widgets."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Self

from tactbench.core.samples import Quality
from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table
    from rich.text import Text

    from tactbench.core.plugins.interfaces import Acquisition
    from tactbench.core.samples import Block, FloatArray
    from tactbench.core.spec.scene import Scene
    from tactbench.core.spec.sensor import StreamSpec

REFRESHES_PER_S = 10
RATE_S = 2.0
"""Seconds over which a rate is measured, and after which a stream of which nothing came is called silent."""
BAR = 8
"""Characters of a taxel's full bar."""
BAD = "bold red"
COUNTED = (Quality.GAP, Quality.MISSING, Quality.SUSPECT, Quality.SATURATED)


class StreamState:
    """What is known of one stream so far.

    One thread calls :meth:`take`; another may read the attributes meanwhile: each is replaced as a whole, none is
    changed in place.
    """

    def __init__(self, spec: StreamSpec) -> None:
        self.spec = spec
        self.rows = 0
        self.first: FloatArray | None = None
        """(channels,) the first sample of each channel; NaN where none came yet."""
        self.latest: FloatArray | None = None
        """(channels,) the last sample of each channel that was not MISSING; NaN where there was none."""
        self.largest: FloatArray | None = None
        """(channels,) largest change from the first sample among the last samples of all blocks."""
        self.wrong: FloatArray | None = None
        """(channels,) marks of quality of the last sample."""
        self.rate_hz: float | None = None
        self.first_ns: int | None = None
        self.last_ns: int | None = None
        self.seen_s: float | None = None
        """When the last block came [s of `time.monotonic`]."""
        self.counts = dict.fromkeys(COUNTED, 0)
        """Rows with a sample that has the mark."""
        self.lost = 0
        """Rows that never came, by the device's numbers."""
        self._first_number: int | None = None
        self._ends: deque[tuple[int, int]] = deque()

    def take(self, block: Block) -> None:
        """Remember the block's last row, and count over its rows."""
        import numpy as np

        if not len(block.data):
            return
        self._take_times(block)
        values = np.array(block.data[[0, -1]], dtype=float)
        if block.quality is not None:
            values[(block.quality[[0, -1]] & Quality.MISSING) != 0] = np.nan
            marks = np.bitwise_or.reduce(block.quality, axis=1)
            self.counts = {flag: self.counts[flag] + int(np.count_nonzero(marks & flag)) for flag in COUNTED}
            self.wrong = block.quality[-1].copy()
        first, latest = values
        self.first = first if self.first is None else np.where(np.isnan(self.first), first, self.first)
        self.latest = latest if self.latest is None else np.where(np.isnan(latest), self.latest, latest)
        change = np.abs(self.latest - self.first)
        self.largest = change if self.largest is None else np.fmax(self.largest, change)
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
        while len(self._ends) > 2 and self.last_ns - self._ends[1][0] >= 1e9 * RATE_S:
            self._ends.popleft()
        began_ns, before = self._ends[0]
        if self.last_ns > began_ns:
            self.rate_hz = (self.rows - before) / (self.last_ns - began_ns) * 1e9


class LiveView:
    """Shows on stderr what is being recorded, from when the rig knows its streams to the end of the ``with`` block.

    Give :meth:`begin` and :meth:`watch` to `acquire`. rich draws in a thread of its own: a slow terminal
    holds nothing back.
    """

    def __init__(self, scene: Scene, title: str) -> None:
        from rich.console import Console
        from rich.live import Live

        self._scene = scene
        self._title = title
        self._sensor: list[StreamState] = []
        self._reference: list[StreamState] = []
        self._states: dict[str, StreamState] = {}
        self._console = Console(stderr=True, highlight=False)
        self._live: Live | None = None
        if self._console.is_terminal and not self._console.is_dumb_terminal:
            self._live = Live(
                get_renderable=self.picture, console=self._console, screen=True, refresh_per_second=REFRESHES_PER_S,
                redirect_stdout=False, redirect_stderr=False,
            )  # fmt: skip
        else:
            remark("stderr is no terminal that --live can draw on: nothing is shown.")

    def begin(self, acquisition: Acquisition) -> None:
        """Begin to draw."""
        self._sensor = [StreamState(spec) for spec in acquisition.streams]
        self._reference = [StreamState(spec) for spec in acquisition.reference]
        self._states = {state.spec.name: state for state in self._sensor + self._reference}
        if self._live is not None:
            self._live.start()

    def watch(self, block: Block) -> None:
        """Remember the newest of a block; no reference to the block is kept."""
        state = self._states.get(block.stream)
        if state is not None:
            state.take(block)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Leave the terminal alone meanwhile, for a prompt."""
        drawing = self._live is not None and self._live.is_started
        if self._live is not None:
            self._live.stop()
        try:
            yield
        finally:
            if self._live is not None and drawing:
                self._live.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the terminal as it was, and the last state on it."""
        if self._live is None or not self._states:
            return
        self._live.stop()
        for state in self._states.values():
            state.seen_s = None  # nothing more is to come
        self._console.print(self.picture())

    def picture(self) -> RenderableType:
        """Return the picture of this moment; what a terminal has no room for is cut off below."""
        from rich.columns import Columns
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        head = Table.grid(expand=True, padding=(0, 1))
        head.add_column(no_wrap=True)
        head.add_column(ratio=1)
        force_n, wanted_n, wrong = self._force()
        texts = ("-" if value is None else f"{value:.2f} N" for value in (force_n, wanted_n))
        force = "force {}, wanted {}".format(*texts) if self._reference else "no reference force"
        bar = ProgressBar(self._scene.profile.largest_n, max(0.0, force_n or 0.0))
        head.add_row(Text(self._title, "bold"), Text(self._time(), justify="right"))
        head.add_row(Text(force, BAD if wrong else "bold"), bar)
        every = [(state, place) for state in self._sensor for place in range(len(state.spec.channels))]
        taxels = [(state, place) for state, place in every if state.spec.channels[place].kind == "taxel"]
        full = max((float(state.largest[place]) for state, place in taxels if state.largest is not None), default=0.0)
        parts: list[RenderableType] = [head, self._rates(), Text("   ".join(_others(every)), overflow="ellipsis")]
        if taxels:
            unit = taxels[0][0].spec.channels[taxels[0][1]].unit
            parts.append(Text(f"{len(taxels)} taxels: change since start [{unit}]; full bar {full:.3g}", "dim"))
            parts.append(Columns([_taxel(*one, full) for one in taxels], padding=(0, 2), column_first=True))
        return Group(*parts)

    def _rates(self) -> Table:
        """Return a line a stream: rows, rate, marks."""
        from rich.table import Table
        from rich.text import Text

        table = Table("stream", box=None, padding=(0, 1), pad_edge=False, header_style="dim")
        for name in ("rows", "Hz/nominal", "lost", *(str(flag.name) for flag in COUNTED)):
            table.add_column(name, justify="right", no_wrap=True)
        for state in self._states.values():
            silent_s = 0.0 if state.seen_s is None else time.monotonic() - state.seen_s
            silent = silent_s >= RATE_S
            rate = Text(f"silent {silent_s:.0f} s" if silent else _rate(state), BAD if silent else "")
            counts = (state.lost, *state.counts.values())
            table.add_row(state.spec.name, str(state.rows), rate, *(Text(str(n), BAD if n else "") for n in counts))
        return table

    def _elapsed_s(self) -> float | None:
        """Return the seconds from the first sample to the last one, by the samples' times; None: no times yet."""
        firsts = [state.first_ns for state in self._states.values() if state.first_ns is not None]
        lasts = [state.last_ns for state in self._states.values() if state.last_ns is not None]
        return (max(lasts) - min(firsts)) * 1e-9 if firsts and lasts else None

    def _time(self) -> str:
        elapsed_s, duration_s = self._elapsed_s(), self._scene.profile.duration.to("s")
        return "waiting for samples" if elapsed_s is None else f"{elapsed_s:.1f} of {duration_s:.1f} s"

    def _force(self) -> tuple[float | None, float | None, bool]:
        """Return the reference's force (`normal` or `fz`, else the first) and the profile's [N]; whether it is bad."""
        import numpy as np

        from tactbench.core.spec import units

        elapsed_s = self._elapsed_s()
        wanted_n = None if elapsed_s is None else float(np.interp(elapsed_s, *self._scene.profile.corners))
        found = [(one, place, channel) for one in self._reference for place, channel in enumerate(one.spec.channels)
                 if channel.kind == "force"]  # fmt: skip
        found.sort(key=lambda one: one[2].name not in ("normal", "fz"))
        for state, place, channel in found[:1]:
            if state.latest is not None and math.isfinite(state.latest[place]):
                return float(state.latest[place]) * units.conversion(channel.unit, "N"), wanted_n, _bad(state, place)
        return None, wanted_n, False


def _bad(state: StreamState, place: int) -> bool:
    """Return whether the last sample of a channel has a mark of quality other than a gap before it."""
    return state.wrong is not None and bool(int(state.wrong[place]) & ~Quality.GAP)


def _rate(state: StreamState) -> str:
    """Return the measured rate over the nominal one [Hz]: ``99.8/100``."""
    return "/".join("-" if rate is None else f"{rate:.4g}" for rate in (state.rate_hz, state.spec.rate_hz))


def _others(channels: list[tuple[StreamState, int]]) -> Iterator[str]:
    """Yield the last values of the sensor's channels that are no taxels."""
    for state, place in channels:
        channel = state.spec.channels[place]
        if channel.kind != "taxel" and state.latest is not None:
            yield f"{channel.name} {state.latest[place]:.5g} {channel.unit}"


def _taxel(state: StreamState, place: int, full: float) -> Text:
    """Return name, change and bar of a taxel; the change rises under load where the channel's sign is known."""
    from rich.text import Text

    channel, change = state.spec.channels[place], math.nan
    if state.latest is not None and state.first is not None:
        change = float(state.latest[place] - state.first[place]) * (channel.sign or 1)
    bar = "━" * round(BAR * abs(change) / full) if full and math.isfinite(change) else ""
    style = BAD if _bad(state, place) else "cyan" if change >= 0 else "yellow"
    return Text(f"{channel.name[:8]:<8} {change:>+8.4g} {bar:<{BAR}}", style)
