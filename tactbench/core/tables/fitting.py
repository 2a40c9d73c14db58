"""How wide the columns of a table are where there is only so much room: long texts go on in a further line.

Widths are in whatever unit `Measure` returns: places of a terminal, or points of a page.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence

Measure = Callable[[str], float]

_LEAST = 4
"""Letters that a column of cut words keeps."""
_PIECE = re.compile(r"(?<=[ ,])(?=[^ ,%…†‡‖])")
"""Where a text may be broken: at a space or a comma, but not before a mark, a unit or what closes an interval."""


def pieces(text: str) -> list[str]:
    """Return the parts of `text` that are never broken."""
    return _PIECE.split(text)


def wrapped(text: str, room: float, measure: Measure) -> list[str]:
    """Return `text` in lines that fit into `room`; a part that is wider stands alone, whole."""
    if measure(text) <= room:
        return [text]
    lines = [""]
    for piece in pieces(text):
        if lines[-1] and measure(lines[-1] + piece.rstrip()) > room:
            lines.append("")
        lines[-1] += piece
    return [line.rstrip() for line in lines]


def cut(piece: str, room: float, measure: Measure) -> list[str]:
    """Return `piece` in lines that fit into `room`, cut between letters."""
    parts = [""]
    for letter in piece:
        if parts[-1] and letter.strip() and measure(parts[-1] + letter) > room:
            parts.append("")
        parts[-1] += letter
    return parts


def fit(
    headers: Sequence[str],
    lines: Sequence[Sequence[str]],
    breakable: Collection[int],
    *,
    room: float,
    gap: float,
    measure: Measure,
    first_to_go: Sequence[int] = (),
    broken_last: Collection[int] = (),
    uncut: Collection[int] = (),
) -> tuple[dict[int, float], list[int]]:
    """Return the columns that fit with their widths, and those that do not fit even with all texts broken.

    Parameters
    ----------
    headers
        Stand above the columns; over two lines where there is no room for one.
    breakable
        Columns whose texts may go on in a further line.
    room
        What there is for all columns and the gaps between them.
    gap
        Between two columns.
    first_to_go
        Columns to leave out, in this order, before a part of a text is broken.
    broken_last
        Columns whose texts are broken only where breaking the others is not enough.
    uncut
        Columns whose words are not cut; those of the others are, where no column may go and there is no room.
    """
    texts = [list({line[place] for line in lines}) for place in range(len(headers))]
    bodies = [max(map(measure, column), default=0.0) for column in texts]
    widths = {place: max(measure(name), bodies[place]) for place, name in enumerate(headers)}
    least = {
        place: max(
            measure(piece.rstrip())
            for text in (name, *texts[place])
            for piece in (pieces(text) if place in breakable or text is name else [text])
        )
        for place, name in enumerate(headers)
    }
    hidden: list[int] = []

    def taken(of: dict[int, float]) -> float:
        return sum(of[place] for place in widths) + gap * (len(widths) - 1)

    for place in first_to_go:
        if taken(least) <= room:
            break
        del widths[place]
        hidden.append(place)
    if taken(widths) > room:
        widths = {place: max(_of_header(headers[place], measure), bodies[place]) for place in widths}
    while taken(widths) > room:
        slack = [place for place in widths if widths[place] - least[place] > 1e-9]
        if not slack and not first_to_go:
            shorter = {place: one if place in uncut else min(one, _LEAST) for place, one in least.items()}
            if shorter != least:
                least = shorter
                continue
        if not slack:
            break
        widest = max(slack, key=lambda place: (place not in broken_last, widths[place]))
        widths[widest] = max(least[widest], widths[widest] - 1.0)
    return widths, hidden


def _of_header(text: str, measure: Measure) -> float:
    """Return the width of a heading over at most two lines."""
    parts = pieces(text)
    halves = [
        max(measure("".join(parts[:place]).rstrip()), measure("".join(parts[place:]))) for place in range(1, len(parts))
    ]
    return min([measure(text), *halves])
