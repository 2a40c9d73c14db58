"""One picture of a recording that is being made, in the size of the terminal."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.progress_bar import ProgressBar  # noqa: TID253  (imported for the live view alone)
from rich.segment import Segment  # noqa: TID253  (imported for the live view alone)
from rich.table import Table  # noqa: TID253  (imported for the live view alone)
from rich.text import Text  # noqa: TID253  (imported for the live view alone)

from tactbench.core.cli.stream_state import COUNTED, StreamState, Watched
from tactbench.core.samples import Quality

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType

HEIGHT = 24
"""Lines of the picture that is left behind, at most."""
SILENT_S = 2.0
"""A stream of which nothing has come for so long says so [s of the host's clock]."""
LEAST_SHARE = 0.02
"""Of a channel's range: a full bar is no less, so that noise draws none. Assumed: an iCub taxel's 1 count of noise is
0.4 % of its range, a BioTac electrode's few counts 0.1 %."""
CELL = 30
"""Columns for a taxel: name, change, bar."""
BAD = "bold red"
_MARKS = (Quality.MISSING, Quality.SATURATED, Quality.SUSPECT)


class Frame:
    """Draws what is known whenever it is printed, in the width and height it is given."""

    def __init__(self, watched: Watched) -> None:
        self._watched = watched

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        height = options.height or min(options.size.height - 1, HEIGHT)
        flowing = options.update(height=None)
        lines: list[list[Segment]] = []
        for part in (_header(self._watched), _force(self._watched), _rates(self._watched), _others(self._watched)):
            lines += console.render_lines(part, flowing)
        room = height - len(lines)
        if room > 1:
            lines += console.render_lines(_taxels(self._watched, options.max_width, room - 1), flowing)
        for line in lines[:height]:
            yield from (*line, Segment.line())


def _row(*cells: RenderableType, bar: int | None = None) -> Table:
    """Return a line of cells, the one at `bar` as wide as there is room."""
    table = Table.grid(expand=True, padding=(0, 1))
    for place in range(len(cells)):
        table.add_column(no_wrap=True, ratio=1 if place == bar else None)
    table.add_row(*cells)
    return table


def _header(watched: Watched) -> Table:
    elapsed_s = watched.elapsed_s
    text = "waiting for samples" if elapsed_s is None else f"{elapsed_s:.1f} of {watched.duration_s:.1f} s"
    return _row(Text(watched.title, "bold"), Text(text, justify="right"), bar=0)


def _force(watched: Watched) -> RenderableType:
    """Return the force, and a bar up to the profile's largest."""
    found = watched.force()
    if found is None:
        return Text("no reference force", "dim")
    state, place = found
    largest = watched.scene.profile.largest_n * _per_newton(state, place)
    value = 0.0 if state.latest is None or not math.isfinite(state.latest[place]) else float(state.latest[place])
    bar = ProgressBar(max(largest, 1e-12), max(0.0, value), complete_style="red" if value > largest else "cyan")
    return _row(Text(f"force {force_text(watched)}", BAD if _wrong(state, place) else "bold"), bar, bar=1)


def force_text(watched: Watched) -> str:
    """Return the force, the one that the scene's profile wants, and what is wrong with it, in words."""
    found = watched.force()
    if found is None or found[0].latest is None:
        return "not known"
    state, place = found
    unit, setpoint_n = state.spec.channels[place].unit, watched.setpoint_n
    wanted = None if setpoint_n is None else setpoint_n * _per_newton(state, place)
    wrong = _wrong(state, place)
    value = None if state.latest is None else state.latest[place]
    return f"{_number(value)} {unit}, wanted {_number(wanted)} {unit}{f', {wrong}' if wrong else ''}"


def _per_newton(state: StreamState, place: int) -> float:
    from tactbench.core.spec import units

    return 1.0 / units.conversion(state.spec.channels[place].unit, "N")


def _number(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.2f}"


def _wrong(state: StreamState, place: int) -> str:
    """Return in words what is wrong with the last sample of a channel."""
    if state.quality is None:
        return ""
    return ", ".join(str(flag.name) for flag in _MARKS if state.quality[place] & flag)


def _taxels(watched: Watched, width: int, height: int) -> Table:
    """Return the taxels as bars, with a title, in at most `height` lines and it; what has no room is counted."""
    taxels = [
        (state, place)
        for state in watched.sensor
        for place, channel in enumerate(state.spec.channels)
        if channel.kind == "taxel"
    ]
    unit = next((one.unit for state in watched.sensor for one in state.spec.channels if one.kind == "taxel"), "")
    full = _full_bar(watched)
    columns = max(1, width // CELL)
    shown = taxels if len(taxels) <= columns * height else taxels[: columns * height - 1]
    rows = math.ceil(len(shown) / columns) or 1
    table = Table.grid(expand=True, padding=(0, 1), collapse_padding=True)
    if taxels:
        table.title = Text(f"taxels: change since start [{unit}]; full bar {full:g}", "dim", justify="left")
    for _ in range(columns):
        table.add_column(no_wrap=True, style="dim")
        table.add_column(no_wrap=True, justify="right")
        table.add_column(ratio=1)
    cells = [_cells(*one, full) for one in shown]
    if len(shown) < len(taxels):
        cells.append((f"… {len(taxels) - len(shown)} more", "", ""))
    for row in range(rows if taxels else 0):
        table.add_row(*(part for place in range(row, len(cells), rows) for part in cells[place]))
    return table


def _cells(state: StreamState, place: int, full: float) -> tuple[RenderableType, RenderableType, RenderableType]:
    """Return name, change and bar of a taxel; the change rises under load where the channel's sign is known."""
    channel, wrong, change = state.spec.channels[place], _wrong(state, place), math.nan
    if state.latest is not None and state.level is not None:
        change = float(state.latest[place] - state.level[place]) * (channel.sign or 1)
    style = BAD if wrong else "cyan" if change >= 0 else "yellow"
    if not math.isfinite(change):
        return channel.name[:8], Text(wrong[:9] or "-", style), ""
    number = f"{change + 0.0:+.4g}{f' {wrong[:3]}' if wrong else ''}"
    return channel.name[:8], Text(number, style), ProgressBar(full, abs(change), complete_style=style)


def _full_bar(watched: Watched) -> float:
    """Return what a full bar stands for: 1, 2 or 5 times a power of ten, at least the largest response so far."""
    import numpy as np

    largest = 0.0
    for state in watched.sensor:
        for place, channel in enumerate(state.spec.channels):
            if channel.kind != "taxel":
                continue
            if channel.lower is not None and channel.upper is not None:
                largest = max(largest, LEAST_SHARE * (channel.upper - channel.lower))
            if state.largest is not None and np.isfinite(state.largest[place]):
                largest = max(largest, float(state.largest[place]))
    if largest <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(largest))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= largest * (1 - 1e-9))


def _others(watched: Watched) -> Text:
    """Return the sensor's channels that are no taxels, and the reference's but the force."""
    force = watched.force()
    words = []
    for state in watched.streams:
        for place, channel in enumerate(state.spec.channels):
            if channel.kind != "taxel" and (state, place) != force:
                known = state.latest is not None and math.isfinite(state.latest[place])
                value = f"{state.latest[place]:.5g}" if known and state.latest is not None else "-"
                words.append(" ".join(filter(None, (channel.name, value, channel.unit, _wrong(state, place)))))
    return Text("   ".join(words), no_wrap=True, overflow="ellipsis", end="")


def rate_text(state: StreamState) -> str:
    """Return the measured rate over the nominal one [Hz]: ``99.8/100``."""
    nominal = "-" if state.spec.rate_hz is None else f"{state.spec.rate_hz:.4g}"
    return f"{'-' if state.rate_hz is None else f'{state.rate_hz:.4g}'}/{nominal}"


def losses_of(state: StreamState) -> str:
    """Return what is lost or wrong in words; empty: nothing."""
    texts = [f"{state.lost} rows lost"] if state.lost else []
    return ", ".join(texts + [f"{number} {flag.name}" for flag, number in state.counts.items() if number])


def _rates(watched: Watched) -> Table:
    """Return a line a stream: rows, rate, marks."""
    table = Table(box=None, padding=(0, 1), pad_edge=False, header_style="dim")
    table.add_column("stream", no_wrap=True)
    for name in ("rows", "Hz/nominal", "lost", *(str(flag.name) for flag in COUNTED)):
        table.add_column(name, justify="right", no_wrap=True)
    elapsed_s, now_s = watched.elapsed_s, time.monotonic()
    over = elapsed_s is not None and elapsed_s >= 0.99 * watched.duration_s  # nothing more is to come
    for state in watched.streams:
        silent_s = 0.0 if state.seen_s is None or over else now_s - state.seen_s
        silent = silent_s >= SILENT_S
        rate = Text(f"silent {silent_s:.0f} s" if silent else rate_text(state), BAD if silent else "")
        counts = (state.lost, *(state.counts[flag] for flag in COUNTED))
        table.add_row(
            state.spec.name, str(state.rows), rate, *(Text(str(one), BAD if one else "") for one in counts)
        )  # fmt: skip
    return table
