"""Tables as LaTeX for the booktabs package: they compile with pdfLaTeX as they are, whatever names are made of."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Sequence

from tactbench.core.tables.text_table import TextTable

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

PAGE_PT = 469.0
"""Width of the text of a two-column paper over both columns, in points."""
SEP_PT = 2.5
"""``\\tabcolsep`` of a table."""


def points(text: str) -> float:
    r"""Return the width of `text` in cmr8 (10 pt documents' ``\footnotesize``), in points, by the font's metrics."""
    return sum(map(_points, text))


def _points(character: str) -> float:
    if character in _WIDTHS:
        return _WIDTHS[character]
    parts = unicodedata.normalize("NFD", character)
    letter, known = parts[0], parts[0] in _WIDTHS and parts[1:] in _ACCENTS
    return _WIDTHS[letter] + 0.5 if known else points(f"U+{ord(character):04X}")


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
    too_wide = over_both and sum(widths) + 2 * SEP_PT * len(widths) > PAGE_PT
    return [
        rf"\begin{{{table}}}[t]",
        r"\centering",
        r"\footnotesize",
        rf"\setlength{{\tabcolsep}}{{{SEP_PT:g}pt}}",
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


def latex(parts: Iterable[TextTable | Sequence[str]]) -> str:
    """Return tables as LaTeX, notes below the table that they follow."""
    tables: list[tuple[TextTable, list[str]]] = []
    for part in parts:
        if isinstance(part, TextTable):
            tables.append((part, [*part.notes]))
        elif tables:
            tables[-1][1].extend(part)
    lines = [line for number, (table, notes) in enumerate(tables) for line in latex_table(table, notes, number=number)]
    return "\n".join(lines) + "\n"


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
