"""The table as LaTeX for the booktabs package: it compiles with pdfLaTeX as it is, whatever names are made of.

What is printed by default fits one column of a two-column paper; all columns make a table over both.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from tactbench.core.leaderboard import view as viewed
from tactbench.core.leaderboard.fitting import fit, wrapped
from tactbench.core.leaderboard.numbers import whole
from tactbench.core.leaderboard.table import Block, Table
from tactbench.core.leaderboard.text import visible
from tactbench.core.leaderboard.view import Grid, View

_TEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': "{''}", "[": "{[}", "]": "{]}", "*": "{*}", "†": r"$\dagger$", "‡": r"$\ddagger$",
    "‖": r"$\|$", "–": "--", "—": "---", "…": r"\ldots{}", "·": r"$\cdot$", "×": r"$\times$", "±": r"$\pm$",
    "≤": r"$\le$", "≥": r"$\ge$", "−": "$-$", "µ": r"$\mu$", "μ": r"$\mu$", "²": r"$^2$", "³": r"$^3$",
    "°": r"$^\circ$", "ß": r"{\ss}", "\n": " ", "\u202f": r"\,",
}  # fmt: skip
"""Brackets and the star are options of ``\\\\`` where they follow it: in braces they are text."""

_ACCENTS = {
    "\u0300": r"\`", "\u0301": r"\'", "\u0302": r"\^", "\u0303": r"\~", "\u0304": r"\=", "\u0306": r"\u",
    "\u0307": r"\.", "\u0308": r"\"", "\u030b": r"\H", "\u030c": r"\v", "\u0327": r"\c",
}  # fmt: skip
_LIGATURE = re.compile(r"-(?=-)|`(?=`)|'(?=')|[!?](?=`)|,(?=,)")
"""The first of two characters that TeX draws as one."""


COLUMN_PT = 239.0
"""Width of one column of a two-column paper, in points: 84 mm or 3.3 in."""
_SEP_PT = 2.5
"""``\\tabcolsep`` inside that column."""
_IN_A_COLUMN = ("sensor", "estimator", "score", "beyond floor", "95 % interval", "95 % beyond", "published")
_FIRST_TO_GO = ("published", "score")
_BREAKABLE = frozenset({"sensor", "estimator", "95 % interval", "95 % beyond"})


def latex(table: Table, view: View = View()) -> str:  # noqa: B008  (frozen)
    """Return the table as LaTeX, a table a block; notes and foot stand below the last block."""
    parts: list[str] = []
    whole_width = view.wide or bool(view.columns)
    last = len(table.blocks) - 1
    for place, (block, grid) in enumerate(zip(table.blocks, viewed.grids(table, view), strict=True)):
        notes = (*viewed.notes(table, view), *viewed.foot(table, view)) if place == last else ()
        if not whole_width:
            grid = _some(grid, _IN_A_COLUMN)
        parts += _table(replace(grid, title=_caption(block, grid)), notes, whole_width=whole_width, number=place)
    for number, section in enumerate(viewed.sections(table, view), len(table.blocks)):
        grid = Grid(section.title, section.columns, section.columns, section.lines, (), section.numeric)
        parts += _table(grid, section.notes, whole_width=True, number=number)
    return "\n".join(parts) + "\n"


def _caption(block: Block, grid: Grid) -> str:
    """Return the title of a block, its verdict, how many samples were tested and what its intervals are."""
    rows = [line.row for line in block.lines if line.row["status"] == "done" and not line.row["is_baseline"]]
    counts = sorted({row["n_test"] for row in rows if row["n_test"] is not None})
    n = f"n = {'–'.join(map(whole, dict.fromkeys((counts[0], counts[-1]))))} test samples" if counts else ""
    methods = sorted({str(row["ci_method"]) for row in rows if row["ci_method"]})
    interval = f"95 % interval by {methods[0]}" if len(methods) == 1 else ""
    said = [text.rstrip(".") for text in (block.title, *grid.said, n, interval) if text]
    return visible(f"{'. '.join(said)}.")


def _some(grid: Grid, names: Collection[str]) -> Grid:
    """Return some columns of a grid."""
    kept = [place for place, name in enumerate(grid.columns) if name in names]
    return replace(
        grid,
        columns=tuple(grid.columns[place] for place in kept),
        headers=tuple(grid.headers[place] for place in kept),
        lines=tuple(tuple(line[place] for place in kept) for line in grid.lines),
    )


def _table(grid: Grid, notes: Iterable[str], *, whole_width: bool, number: int) -> list[str]:
    """Return a grid as a table: of one column, long texts broken into further lines; or over both, as it is."""
    if whole_width:
        return latex_grid(grid.title, grid.headers, _right(grid), grid.lines, notes, number=number, star=True)
    places = {name: place for place, name in enumerate(grid.columns)}
    gap = 2 * _SEP_PT
    widths, gone = fit(
        grid.headers, grid.lines, {places[name] for name in _BREAKABLE if name in places}, room=COLUMN_PT - gap, gap=gap,
        measure=points, first_to_go=[places[name] for name in _FIRST_TO_GO if name in places],
    )  # fmt: skip
    if gone:
        notes = [*notes, f"There was no room for: {', '.join(grid.headers[place] for place in gone)}."]
    lines = [line for cells in grid.lines for line in _broken(cells, widths)]
    heads = list(_broken(grid.headers, widths))
    names = [grid.columns[place] for place in widths]
    right = {str(place) for place, name in enumerate(names) if name in grid.numeric}
    return latex_grid(grid.title, map(str, range(len(names))), right, lines, notes, heads=heads, number=number)


def _right(grid: Grid) -> set[str]:
    return {head for name, head in zip(grid.columns, grid.headers, strict=True) if name in grid.numeric}


def _broken(cells: Sequence[str], widths: Mapping[int, float]) -> Iterator[list[str]]:
    parts = [wrapped(cells[place], room, points) for place, room in widths.items()]
    for number in range(max(map(len, parts))):
        yield [part[number] if number < len(part) else "" for part in parts]


def points(text: str) -> float:
    """Return an upper estimate of the width of `text` in cmr8, in points.

    Widths of the font's metrics (cmr8.tfm: digits 4.25 pt, m 7.08, w 6.14, M 7.79, W 8.73, no other letter wider than
    6.7 or, small, than 4.73), rounded up within groups of characters; what is in none of them is taken for a wide one.
    """
    return sum(_POINTS.get(character, 4.8 if character.islower() else 6.8) for character in text)


_POINTS = {
    **dict.fromkeys("0123456789-–'`\"", 4.3), **dict.fromkeys(".,:;!| ijl", 2.9), **dict.fromkeys("()[]/ftsrI", 3.7),
    "m": 7.2, "w": 6.3, "M": 7.9, "W": 8.8, "…": 10.5, "%": 7.2, "†": 3.9, "‡": 3.9, "=": 6.7, "+": 6.7, "_": 4.7,
    "\u202f": 1.5,
}  # fmt: skip


def latex_grid(
    title: str,
    columns: Iterable[str],
    numeric: Collection[str],
    lines: Iterable[Iterable[str]],
    notes: Iterable[str],
    *,
    heads: Iterable[Iterable[str]] = (),
    number: int = 0,
    star: bool = False,
) -> list[str]:
    """Return a table as lines of LaTeX, columns of numbers to the right, notes below.

    Parameters
    ----------
    heads
        Lines of headings, if they are not the names of the columns.
    number
        Of the table among those of one file, from 0: its label ends in it, counted from 1.
    star
        Whether it goes over both columns of a two-column paper.
    """
    names = list(columns)
    table = "table*" if star else "table"
    return [
        rf"\begin{{{table}}}[t]",
        r"\centering",
        r"\footnotesize",
        rf"\setlength{{\tabcolsep}}{{{_SEP_PT:g}pt}}",
        rf"\caption{{{tex(title)}}}",
        rf"\label{{{_label(title, number)}}}",
        rf"\begin{{tabular}}{{{''.join('r' if name in numeric else 'l' for name in names)}}}",
        r"\toprule",
        *(" & ".join(map(tex, line)) + r" \\" for line in (list(heads) or [names])),
        r"\midrule",
        *(" & ".join(map(tex, line)) + r" \\" for line in lines),
        r"\bottomrule",
        r"\end{tabular}",
        *(rf"\par\smallskip\raggedright {tex(note)}" for note in notes),
        rf"\end{{{table}}}",
        "",
    ]


def _label(title: str, number: int) -> str:
    """Return a label of what the title begins with, and of the table's number: ``tab:tactbench-force-1``."""
    first = re.sub(r"[^A-Za-z0-9]+", "-", title.split(" · ")[0].split(":")[0]).strip("-").lower()
    return f"tab:tactbench-{first or 'table'}-{number + 1}"


def tex(text: str) -> str:
    """Return text that LaTeX sets as it is; a character it has no letter for is told by its number, ``U+4E2D``."""
    return "".join(map(_character, _LIGATURE.sub("\\g<0>\0", text)))


def _character(character: str) -> str:
    if character == "\0":
        return "{}"
    if character in _TEX:
        return _TEX[character]
    if character.isascii():
        return character
    parts = unicodedata.normalize("NFD", character)
    letter, marks = parts[0], parts[1:]
    if letter.isascii() and letter.isalpha() and marks in _ACCENTS:
        # An accent above i or j takes the place of the dot.
        dotless = rf"\{letter}" if letter in "ij" and marks != "\u0327" else letter
        return f"{_ACCENTS[marks]}{{{dotless}}}"
    return f"U+{ord(character):04X}"
