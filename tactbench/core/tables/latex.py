"""Output of tables as LaTeX for pdfLaTeX with the packages booktabs and graphicx; all texts are escaped."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable

from tactbench.core.tables.text_table import TextTable

_TEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_\allowbreak{}",
    "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': "{''}", "[": "{[}", "]": "{]}", "*": "{*}", "†": r"$\dagger$", "‡": r"$\ddagger$",
    "‖": r"$\|$", "–": "--", "—": "---", "…": r"\ldots{}", "·": r"$\cdot$", "×": r"$\times$", "±": r"$\pm$",
    "≤": r"$\le$", "≥": r"$\ge$", "−": "$-$", "µ": r"$\mu$", "μ": r"$\mu$", "²": r"$^2$", "³": r"$^3$",
    "=": r"=\allowbreak{}", "°": r"$^\circ$", "ß": r"{\ss}", "\n": " ", "\u202f": r"\,",
}  # fmt: skip
"""LaTeX code by character; brackets and the star are in braces, since after ``\\\\`` they would be options."""


def latex(tables: Iterable[TextTable], wide: bool = True) -> str:
    """Return tables as LaTeX, at most as wide as one column of a paper, or as both if `wide`."""
    return "\n".join(_table(one, number, "table*" if wide else "table") for number, one in enumerate(tables, 1))


def _table(table: TextTable, number: int, environment: str) -> str:
    """Return a table as LaTeX, with its title as the caption and a rule above trivial answers.

    Backticks in notes are removed. A table that is wider than the text is scaled down.
    """
    lines = [" & ".join(map(tex, line)) + r" \\" for line in (table.headers, *table.lines)]
    first = table.kinds.index("baseline") if "baseline" in table.kinds else 0
    for place in sorted({0, first}, reverse=True):
        lines.insert(place + 1, r"\midrule")
    return "\n".join([
        "% Packages: booktabs, graphicx.",
        rf"\begin{{{environment}}}[t]",
        r"\centering",
        r"\footnotesize",
        r"\setlength{\tabcolsep}{2.5pt}\setlength{\belowcaptionskip}{4pt}",
        rf"\caption{{{tex(table.title)}}}",
        rf"\label{{{_label(table.title, number)}}}",
        r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{%",
        rf"\begin{{tabular}}{{{''.join('r' if right else 'l' for right in table.right)}}}",
        r"\toprule",
        *lines,
        r"\bottomrule",
        r"\end{tabular}}",
        *(rf"\par\smallskip\raggedright {tex(note.replace('`', ''))}" for note in table.notes),
        rf"\end{{{environment}}}",
        "",
    ])  # fmt: skip


def _label(title: str, number: int) -> str:
    """Return a LaTeX label made of the first words of the title and the table's number: ``tab:tactbench-force-1``."""
    first = re.sub(r"[^A-Za-z0-9]+", "-", re.split(" · |[:.,]", title)[0]).strip("-").lower()
    return f"tab:tactbench-{first or 'table'}-{number}"


def tex(text: str) -> str:
    """Return text escaped for LaTeX; characters that pdfLaTeX cannot print become code points: ``U+4E2D``."""
    return "".join(map(_character, text))


def _character(character: str) -> str:
    if character in _TEX:
        return _TEX[character]
    if character.isascii():
        return character
    if "À" <= character <= "ÿ" and unicodedata.decomposition(character):
        return character  # an ASCII letter with an accent
    return f"U+{ord(character):04X}"
