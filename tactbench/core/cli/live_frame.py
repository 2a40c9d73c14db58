"""One picture of a recording that is being made: lines of text that fill a terminal, 80 x 24 or whatever it is."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tactbench.core.cli.stream_state import COUNTED, StreamState, Watched, channel_of
from tactbench.core.samples import Quality

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.text import Text

    from tactbench.core.spec.sensor import ChannelSpec

HEIGHT = 24
"""Lines of a picture where the terminal does not say how many it has."""
LOW = 20
"""Below so many lines the force is a line instead of three."""
SILENT_S = 2.0
"""A stream of which nothing has come for so long says so [s of the host's clock]."""
LEAST_SHARE = 0.02
"""Of a channel's range: a full bar is no less, so that noise draws none. Assumed: an iCub taxel's 1 count of noise is
0.4 % of its range, a BioTac electrode's few counts 0.1 %."""
NAME_WIDTH = 8
"""Characters of a channel's name that are shown in a bar or a map."""
LEVELS = " ▁▂▃▄▅▆▇█"
MARKS = {Quality.MISSING: "M", Quality.SATURATED: "S", Quality.SUSPECT: "?"}
UP, DOWN, BAD = "cyan", "yellow", "bold red"

_DIGITS = {
    "0": ("╭─╮", "│ │", "╰─╯"),
    "1": ("╶╮ ", " │ ", " ╵ "),
    "2": ("╶─╮", "╭─╯", "╰─╴"),
    "3": ("╶─╮", " ─┤", "╶─╯"),
    "4": ("╷ ╷", "╰─┤", "  ╵"),
    "5": ("╭─╴", "╰─╮", "╶─╯"),
    "6": ("╭─╴", "├─╮", "╰─╯"),
    "7": ("╶─╮", "  │", "  ╵"),
    "8": ("╭─╮", "├─┤", "╰─╯"),
    "9": ("╭─╮", "╰─┤", "╶─╯"),
    "-": ("   ", "╶─╴", "   "),
    ".": (" ", " ", "."),
}
_DIGITS_WIDTH, _FORCE_WIDTH = 22, 44
"""Columns of the large digits (``-12.34 N``), and of them with name, unit and wanted force."""


class Frame:
    """Draws what is known whenever it is printed, in the width and height it is given."""

    def __init__(self, watched: Watched) -> None:
        self._watched = watched

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        yield from frame(self._watched, options.max_width, options.height or min(options.size.height - 1, HEIGHT))


def frame(watched: Watched, width: int, height: int) -> list[Text]:
    """Return at most `height` lines of at most `width` characters."""
    head = [_header(watched, width), *_force(watched, width, low=height < LOW)]
    rates = _rates(watched, time.monotonic())
    others = _others(watched, width)
    left = height - len(head) - len(rates) - len(others)
    lines = [*head, *_taxels(watched, width, left), *others, *rates][:height]
    for line in lines:
        line.no_wrap = True
        line.truncate(width)
    return lines


def _header(watched: Watched, width: int) -> Text:
    from rich.text import Text

    elapsed_s = watched.elapsed_s
    text = "waiting for samples" if elapsed_s is None else f"{elapsed_s:.1f} of {watched.duration_s:.1f} s"
    title = watched.title[: max(0, width - len(text) - 2)]
    return Text.assemble((title, "bold"), " " * (width - len(title) - len(text)), text)


def _number(value: float | None, decimals: int) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.{decimals}f}"


def force_text(watched: Watched) -> str:
    """Return the force, the one that the scene's profile wants, and what is wrong with it, in words."""
    found = watched.force()
    if found is None or found[0].latest is None:
        return "not known"
    state, place = found
    unit = channel_of(state, place).unit
    bad = _bad(state, place)
    return f"{_value(state, place)} {unit}, wanted {_setpoint(watched, unit)} {unit}{f', {bad}' if bad else ''}"


def _value(state: StreamState, place: int) -> str:
    return "-" if state.latest is None else _number(float(state.latest[place]), 2)


def _bad(state: StreamState, place: int) -> str:
    """Return in words what is wrong with the last sample of a channel."""
    if state.quality is None:
        return ""
    return ", ".join(str(flag.name) for flag in MARKS if state.quality[place] & flag)


def _in_unit(newtons: float, unit: str) -> float:
    from tactbench.core.spec import units

    return newtons / units.conversion(unit, "N")


def _setpoint(watched: Watched, unit: str) -> str:
    setpoint_n = watched.setpoint_n
    return _number(None if setpoint_n is None else _in_unit(setpoint_n, unit), 2)


def _force(watched: Watched, width: int, *, low: bool) -> list[Text]:
    """Return the force: three lines of large digits, with a bar up to the profile's largest; or one line."""
    from rich.text import Text

    found = watched.force()
    if found is None:
        return [Text("no reference force", style="dim")]
    if low:
        return [Text(f"force {force_text(watched)}", style="bold")]
    state, place = found
    channel = channel_of(state, place)
    text = _value(state, place)
    drawn = ["".join(_DIGITS[sign][row] for sign in text) for row in range(3)]
    bad = _bad(state, place)
    drawn[2] += f" {channel.unit}"
    beside = (
        (f"{channel.name} of {state.spec.name}", ""),
        (f"wanted {_setpoint(watched, channel.unit)} {channel.unit}", ""),
        (bad, BAD),
    )
    lines = []
    for row, (label, style) in zip(drawn, beside, strict=True):
        line = Text.assemble((f"  {row}", "bold"))
        line.pad_right(_DIGITS_WIDTH - line.cell_len)
        line.append(f" {label}", style)
        line.pad_right(_FORCE_WIDTH - line.cell_len)
        lines.append(line)
    largest = _in_unit(watched.scene.profile.largest_n, channel.unit)
    room = width - _FORCE_WIDTH
    if room >= 10 and largest > 0 and state.latest is not None:
        setpoint_n = watched.setpoint_n
        target = None if setpoint_n is None else _in_unit(setpoint_n, channel.unit)
        lines[1].append_text(_track(float(state.latest[place]), target, largest, room))
        lines[2].append(f"0{f'{largest:g} {channel.unit}':>{room - 1}}", style="dim")
    return lines


def _track(value: float, target: float | None, largest: float, room: int) -> Text:
    """Return a bar from 0 to `largest`, the place of `target` marked."""
    from rich.text import Text

    share = value / largest if math.isfinite(value) else 0.0
    filled = round(min(1.0, max(0.0, share)) * room)
    line = Text("█" * filled + "·" * (room - filled))
    line.stylize("red" if share > 1 else UP, 0, filled)
    if target is not None:
        at = min(room - 1, max(0, round(target / largest * room)))
        line = Text.assemble(line[:at], ("┃", "bold"), line[at + 1 :])
    return line


@dataclass(frozen=True)
class _Taxel:
    """What is drawn of one taxel."""

    channel: ChannelSpec
    response: float
    """Change from the level, rising under load where the channel's sign is known."""
    mark: str

    @property
    def name(self) -> str:
        return self.channel.name[:NAME_WIDTH]

    @property
    def style(self) -> str:
        return BAD if self.mark else UP if self.response >= 0 else DOWN


def _taxels(watched: Watched, width: int, height: int) -> list[Text]:
    """Return a title and the taxels: by place where that overlaps nowhere, else as bars."""
    from rich.text import Text

    taxels = [
        _taxel(state, place)
        for state in watched.sensor
        for place, channel in enumerate(state.spec.channels)
        if channel.kind == "taxel"
    ]
    if not taxels:
        return []
    full = _full_bar(watched)
    decimals = 0 if taxels[0].channel.unit == "count" else max(0, 2 - math.floor(math.log10(full)))
    signed = all(taxel.channel.sign for taxel in taxels)
    direction = ", + load" if signed else ""
    title = f"taxels: change since start [{taxels[0].channel.unit}{direction}]; █ {full:g}"
    room = max(1, height - 1)
    drawn = _map(taxels, full, decimals, width, room)
    if drawn is not None:
        title += "; pad from outside, tip right"
    return [Text(title, style="dim"), *(drawn or _bars(taxels, full, decimals, width, room))]


def _taxel(state: StreamState, place: int) -> _Taxel:
    channel = channel_of(state, place)
    mark = ""
    if state.quality is not None:
        mark = next((sign for flag, sign in MARKS.items() if state.quality[place] & flag), "")
    if state.latest is None or state.level is None:
        return _Taxel(channel, math.nan, mark)
    return _Taxel(channel, float(state.latest[place] - state.level[place]) * (channel.sign or 1), mark)


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


def _signed(taxel: _Taxel, decimals: int) -> str:
    # Adding zero makes a negative one positive.
    return f"{round(taxel.response, decimals) + 0.0:+.{decimals}f}" if math.isfinite(taxel.response) else "-"


def _map(taxels: Sequence[_Taxel], full: float, decimals: int, width: int, height: int) -> list[Text] | None:
    """Return the taxels at their x (to the right) and y (downwards), as who looks at the pad sees them.

    None where a channel has no place, or two of them would overlap.
    """
    from rich.text import Text

    places = [taxel.channel.position_m for taxel in taxels]
    xs, ys = [at[0] for at in places if at], [at[1] for at in places if at]
    if len(xs) < len(taxels):
        return None
    names = max(len(taxel.name) for taxel in taxels)
    digits = len(f"{full:+.{decimals}f}")
    cell = names + 1 + digits + 2  # name, level, number, mark, blank
    across, down = max(xs) - min(xs), max(ys) - min(ys)
    if cell > width or (across == 0 and down == 0):
        return None
    rows: list[dict[int, _Taxel]] = [{} for _ in range(height if down else 1)]
    for taxel, x, y in zip(taxels, xs, ys, strict=True):
        row = round((y - min(ys)) / down * (len(rows) - 1)) if down else 0
        column = round((x - min(xs)) / across * (width - cell)) if across else 0
        if any(abs(column - other) < cell for other in rows[row]):
            return None
        rows[row][column] = taxel
    lines = []
    for row_of in rows:
        line = Text()
        for column, taxel in sorted(row_of.items()):
            line.pad_right(column - line.cell_len)
            share = min(1.0, abs(taxel.response) / full) if math.isfinite(taxel.response) else 0.0
            line.append(f"{taxel.name:>{names}}", style="dim")
            line.append(LEVELS[round(share * (len(LEVELS) - 1))], style=taxel.style)
            line.append(f"{_signed(taxel, decimals):>{digits}}{taxel.mark}", style=taxel.style)
        lines.append(line)
    return lines


def _bars(taxels: Sequence[_Taxel], full: float, decimals: int, width: int, height: int) -> list[Text]:
    """Return the taxels in as few columns as the height allows; what has no room is counted."""
    from rich.text import Text

    names = max(len(taxel.name) for taxel in taxels)
    digits = len(f"{full:+.{decimals}f}")
    least = names + 1 + digits + 1 + 3  # name, number, mark, at least two characters of bar, blank
    columns = max(1, min(math.ceil(len(taxels) / height), width // least))
    rows = min(height, math.ceil(len(taxels) / columns))
    shown = rows * columns
    if shown < len(taxels):
        shown -= 1
    cell = width // columns
    room = max(0, cell - (names + 1 + digits + 1) - 1)
    lines = [Text() for _ in range(rows)]
    for number, taxel in enumerate(taxels[:shown]):
        line = lines[number % rows]
        line.pad_right((number // rows) * cell - line.cell_len)
        line.append(f"{taxel.name:<{names}} ", style="dim")
        line.append(f"{_signed(taxel, decimals):>{digits}}{taxel.mark or ' '}", style=taxel.style)
        line.append(_bar(taxel.response / full, room), style=taxel.style)
    if shown < len(taxels):
        line = lines[shown % rows]
        line.pad_right((shown // rows) * cell - line.cell_len)
        line.append(f"… {len(taxels) - shown} more"[:cell], style="dim")
    return lines


def _bar(share: float, room: int) -> str:
    """Return a bar of eighths of a character for a rise, hatched for a fall."""
    if not math.isfinite(share):
        return ""
    if share < 0:
        return "▒" * round(min(1.0, -share) * room)
    eighths = round(min(1.0, share) * room * 8)
    return "█" * (eighths // 8) + " ▏▎▍▌▋▊▉"[eighths % 8].strip()


def _others(watched: Watched, width: int) -> list[Text]:
    """Return the sensor's channels that are no taxels, and the reference's but the force, in at most two lines."""
    from rich.text import Text

    force = watched.force()
    words = [
        f"{channel.name} {_plain(state, place)} {channel.unit}{' ' + bad if (bad := _bad(state, place)) else ''}"
        for state in watched.streams
        for place, channel in enumerate(state.spec.channels)
        if channel.kind != "taxel" and (state, place) != force
    ]
    lines = [""]
    for word in words:
        longer = f"{lines[-1]}   {word}" if lines[-1] else word
        if len(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    if len(lines) > 2:
        lines = [lines[0], lines[1][: width - 2] + " …"]
    return [Text(line) for line in lines if line]


def _plain(state: StreamState, place: int) -> str:
    if state.latest is None or not math.isfinite(state.latest[place]):
        return "-"
    return f"{state.latest[place]:.5g}"


def rate_text(state: StreamState) -> str:
    """Return the measured rate over the nominal one [Hz]: ``99.8/100``."""
    nominal = "-" if state.spec.rate_hz is None else f"{state.spec.rate_hz:.4g}"
    return f"{'-' if state.rate_hz is None else f'{state.rate_hz:.4g}'}/{nominal}"


def losses_of(state: StreamState) -> str:
    """Return what is lost or wrong in words; empty: nothing."""
    texts = [f"{state.lost} rows lost"] if state.lost else []
    texts += [f"{number} {flag.name}" for flag, number in state.counts.items() if number]
    return ", ".join(texts)


def _rates(watched: Watched, now_s: float) -> list[Text]:
    """Return a line a stream: rows, rate, marks."""
    from rich.text import Text

    names = max(len("stream"), *(len(state.spec.name) for state in watched.streams))
    marks = "".join(f"{flag.name or '':>10}" for flag in COUNTED)
    lines = [Text(f"{'stream':<{names}}{'rows':>9}{'Hz/nominal':>13}{'lost':>6}{marks}", style="dim")]
    for state in watched.streams:
        silent_s = 0.0 if state.seen_s is None or _over(watched) else now_s - state.seen_s
        rate = f"silent {silent_s:.0f} s" if silent_s >= SILENT_S else rate_text(state)
        line = Text(f"{state.spec.name:<{names}}{state.rows:>9}")
        line.append(f"{rate:>13}", style=BAD if silent_s >= SILENT_S else "")
        line.append(f"{state.lost:>6}", style=BAD if state.lost else "")
        for flag in COUNTED:
            line.append(f"{state.counts[flag]:>10}", style=BAD if state.counts[flag] else "")
        lines.append(line)
    return lines


def _over(watched: Watched) -> bool:
    """Whether the scene has come to its end: nothing more is to come."""
    elapsed_s = watched.elapsed_s
    return elapsed_s is not None and elapsed_s >= 0.99 * watched.duration_s
