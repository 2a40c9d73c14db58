"""The table as LaTeX for the booktabs package: it compiles with pdfLaTeX as it is, whatever names are made of.

What is printed by default fits one column of a two-column paper; all columns make a table over both.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from tactbench.core.leaderboard import view as viewed
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.columns import INTERVALS
from tactbench.core.leaderboard.fitting import fit, wrapped
from tactbench.core.leaderboard.notes import RANKS, interval_notes
from tactbench.core.leaderboard.numbers import whole
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.text import visible
from tactbench.core.leaderboard.text_table import TextTable
from tactbench.core.leaderboard.view import DEFAULT_VIEW, View

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


COLUMN_PT = 229.0
"""Width of one column of a two-column paper, in points: of the class article 229.5, of others 239 (84 mm) and more."""
PAGE_PT = 469.0
"""Width of its text over both columns."""
_SEP_PT = 2.5
"""``\\tabcolsep`` inside that column."""
_IN_A_COLUMN = ("sensor", "estimator", "score", "beyond floor", "95 % interval", "95 % beyond", "published")
_FIRST_TO_GO = ("published", "score")


def latex(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return the table as LaTeX, a table a block; notes and footer stand below the last block."""
    parts: list[str] = []
    whole_width = view.wide or bool(view.columns)
    last = len(table.blocks) - 1
    for place, (block, grid) in enumerate(zip(table.blocks, viewed.grids(table, view), strict=True)):
        # A paper's table shows no ranks.
        shown = [note for note in viewed.notes(table, view) if whole_width or note != RANKS]
        notes = (*shown, *viewed.footer(table, view)) if place == last else ()
        grid = grid if whole_width else _narrow(grid)
        parts += _table(replace(grid, title=_caption(block, grid)), notes, whole_width=whole_width, number=place)
    for number, section in enumerate(viewed.sections(table, view), len(table.blocks)):
        parts += _table(section, section.notes, whole_width=True, number=number)
    parts += [f"% {tex(text)}" for text in viewed.commands(table, view)]
    return "\n".join(parts) + "\n"


def _caption(block: Block, grid: TextTable) -> str:
    """Return the title of a block, its verdict, how many samples were tested and what its intervals are."""
    rows = [line.row for line in block.lines if line.row["status"] == "done" and not line.row["is_baseline"]]
    counts = sorted({row["n_test"] for row in rows if row["n_test"] is not None})
    n = f"n = {'–'.join(map(whole, dict.fromkeys((counts[0], counts[-1]))))} test samples" if counts else ""
    task = f"{visible(str(block.lines[0].row['task']))}: "
    how = [f"95 % {text.removeprefix(task)}" for text in interval_notes(rows)] if rows else []
    rule = "Below the rule: trivial answers" if "#" not in grid.columns and _first_trivial(grid) else ""
    said = [text.rstrip(".") for text in (block.title, *grid.summary[:1], n, *how, rule) if text]
    return f"{'. '.join(said)}."


def _narrow(grid: TextTable) -> TextTable:
    """Return the columns of a paper's table."""
    kept = [place for place, name in enumerate(grid.columns) if name in _IN_A_COLUMN]
    lines = tuple(tuple(line[place] for place in kept) for line in grid.lines)
    names = [grid.columns[place] for place in kept]
    headers = tuple(grid.headers[place] for place in kept)
    return replace(grid, columns=tuple(names), headings=headers, lines=lines)


def _table(grid: TextTable, notes: Iterable[str], *, whole_width: bool, number: int) -> list[str]:
    """Return a grid as a table: of one column, long texts broken into further lines; or over both, as it is."""
    if whole_width:
        return latex_table(grid, notes, number=number)
    places = {name: place for place, name in enumerate(grid.columns)}
    gap = 2 * _SEP_PT
    intervals = {places[name] for name in INTERVALS if name in places}
    widths, gone = fit(
        grid.headers, grid.lines, {places["sensor"], places["estimator"], *intervals}, room=COLUMN_PT - gap, gap=gap,
        measure=points, first_to_go=[places[name] for name in _FIRST_TO_GO if name in places], broken_last=intervals,
    )  # fmt: skip
    if gone:
        notes = [*notes, f"There was no room for: {', '.join(grid.headers[place] for place in gone)}."]
    lines = [list(_broken(cells, widths)) for cells in grid.lines]
    rules = [sum(map(len, lines[:place])) for place in _first_trivial(grid)]
    heads = list(_broken(grid.headers, widths))
    kept = replace(
        grid,
        columns=tuple(grid.columns[place] for place in widths),
        headings=(),
        lines=tuple(tuple(line) for one in lines for line in one),
    )
    return latex_table(kept, notes, headings=heads, number=number, over_both=False, rules=rules)


def _first_trivial(grid: TextTable) -> list[int]:
    """Return the place of the first trivial answer, if a table of one column, which shows no ranks, has some."""
    return [grid.kinds.index("baseline")] if "baseline" in grid.kinds and grid.kinds[0] != "baseline" else []


def _broken(cells: Sequence[str], widths: Mapping[int, float]) -> Iterator[list[str]]:
    parts = [wrapped(cells[place], room, points) for place, room in widths.items()]
    for number in range(max(map(len, parts))):
        yield [part[number] if number < len(part) else "" for part in parts]


def points(text: str) -> float:
    r"""Return the width of `text` in cmr8 (10 pt documents' ``\footnotesize``), in points, by the font's metrics."""
    return sum(map(_points, text))


def _points(character: str) -> float:
    if character in _WIDTHS:
        return _WIDTHS[character]
    letter = unicodedata.normalize("NFD", character)[0]
    return _WIDTHS[letter] + 0.5 if letter in _WIDTHS else points(f"U+{ord(character):04X}")


_WIDTHS = {
    character: width
    for width, characters in (
        (1.42, "\u202f"), (2.37, "!',.:;<[]`il|"), (2.6, "fj"), (2.84, "- "), (3.07, "_I"), (3.31, "()t"), (3.32, "r"),
        (3.36, "s"), (3.78, "cez†‡"), (4.02, ">?"), (4.26, '"$*/0123456789^ago{}~–‖\\'), (4.37, "J"), (4.49, "kqvxy"),
        (4.73, "Sbdhnpu"), (5.12, "µμ"), (5.2, "Z"), (5.31, "L"), (5.55, "F"), (5.79, "EP"), (6.02, "B"),
        (6.14, "CTw"), (6.26, "R"), (6.37, "AHNUVXY"), (6.49, "D"), (6.61, "K"), (6.62, "&+=@OQ<>×±−≤≥"), (6.67, "G"),
        (7.09, "#%m"), (7.79, "M"), (8.51, "—"), (8.73, "W"), (12.3, "…"),
    )
    for character in characters
}  # fmt: skip
"""Read off with ``\\wd`` of a box for each character in ``\\footnotesize`` of the class article, rounded up; ``…`` with
the wider space that follows it."""


def latex_table(
    grid: TextTable,
    notes: Iterable[str],
    *,
    headings: Iterable[Iterable[str]] = (),
    number: int = 0,
    over_both: bool = True,
    rules: Collection[int] = (),
) -> list[str]:
    """Return a table as lines of LaTeX, columns of numbers to the right, notes below.

    Parameters
    ----------
    headings
        Lines of headings, if there is not one.
    number
        Of the table among those of one file, from 0: its label ends in it, counted from 1.
    over_both
        Whether it goes over both columns of a two-column paper.
    rules
        Lines above which there is a rule.
    """
    lines, heads = grid.lines, list(headings) or [grid.headers]
    table = "table*" if over_both else "table"
    widths = [max(map(points, texts)) for texts in zip(grid.headers, *lines, strict=True)]
    too_wide = over_both and sum(widths) + 2 * _SEP_PT * len(widths) > PAGE_PT
    return [
        rf"\begin{{{table}}}[t]",
        r"\centering",
        r"\footnotesize",
        rf"\setlength{{\tabcolsep}}{{{_SEP_PT:g}pt}}",
        rf"\caption{{{tex(grid.title)}}}",
        rf"\label{{{_label(grid.title, number)}}}",
        r"\par\smallskip",
        *([r"\resizebox{\textwidth}{!}{% of the package graphicx"] if too_wide else []),
        rf"\begin{{tabular}}{{{''.join('r' if right else 'l' for right in grid.right)}}}",
        r"\toprule",
        *(" & ".join(map(tex, line)) + r" \\" for line in heads),
        r"\midrule",
        *("\\midrule\n" * (place in rules) + " & ".join(map(tex, line)) + r" \\" for place, line in enumerate(lines)),
        r"\bottomrule",
        r"\end{tabular}" + "}" * too_wide,
        # Text between backticks is code elsewhere.
        *(rf"\par\smallskip\raggedright {tex(note.replace('`', ''))}" for note in notes),
        rf"\end{{{table}}}",
        "",
    ]


def latex_tables(tables: Sequence[TextTable], notes: Sequence[str]) -> str:
    """Return tables as LaTeX, notes below the last."""
    parts: list[str] = []
    for number, table in enumerate(tables):
        parts += latex_table(table, notes if table is tables[-1] else (), number=number)
    return "\n".join(parts) + "\n"


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
