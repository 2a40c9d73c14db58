"""The table as LaTeX for the booktabs package: it compiles with pdfLaTeX as it is, whatever names are made of."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable

from tactbench.core.leaderboard.columns import NUMERIC
from tactbench.core.leaderboard.table import Table

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


def latex(table: Table) -> str:
    """Return the table as LaTeX, a table a block; notes and foot stand below the last block."""
    parts: list[str] = []
    last = len(table.blocks) - 1
    for place, block in enumerate(table.blocks):
        lines = [line.cells for line in block.lines]
        notes = (*table.notes, *table.foot) if place == last else ()
        parts += latex_grid(block.title, table.columns, NUMERIC, lines, notes)
    for section in table.sections:
        parts += latex_grid(section.title, section.columns, section.numeric, section.lines, section.notes)
    return "\n".join(parts) + "\n"


def latex_grid(
    title: str,
    columns: Iterable[str],
    numeric: Collection[str],
    lines: Iterable[Iterable[str]],
    notes: Iterable[str],
) -> list[str]:
    """Return a table as lines of LaTeX, columns of numbers to the right, notes below."""
    names = list(columns)
    return [
        r"\begin{table}",
        rf"\caption{{{tex(title)}}}",
        rf"\begin{{tabular}}{{{''.join('r' if name in numeric else 'l' for name in names)}}}",
        r"\toprule",
        " & ".join(map(tex, names)) + r" \\",
        r"\midrule",
        *(" & ".join(map(tex, line)) + r" \\" for line in lines),
        r"\bottomrule",
        r"\end{tabular}",
        *(rf"\par\footnotesize {tex(note)}" for note in notes),
        r"\end{table}",
        "",
    ]


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
