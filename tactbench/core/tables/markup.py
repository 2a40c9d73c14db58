"""Output of tables as HTML, as LaTeX (pdfLaTeX, booktabs, graphicx) and as Markdown; all texts are escaped."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence

from tactbench.core.tables.text import TextTable

_TEMPLATE = """\
{% for table in tables %}
<p>{{ table.title }} {{ table.origin }}{% for text in table.summary %}<br>{{ text }}{% endfor %}</p>
<table>
<thead><tr>{% for name in table.headers %}<th>{{ name }}</th>{% endfor %}</tr></thead>
<tbody>
{% for line in table.lines %}
<tr>{% for text in line %}<td style="text-align: {{ "right" if table.right[loop.index0] else "left" }}">{{ text }}</td>\
{% endfor %}</tr>
{% endfor %}
</tbody>
</table>
<p>{% for note in table.notes %}{{ note }}<br>{% endfor %}</p>
{% endfor %}
"""


def html(tables: Iterable[TextTable]) -> str:
    """Return tables and their notes as HTML without scripts; all texts are escaped."""
    from jinja2 import Environment

    return Environment(autoescape=True, trim_blocks=True).from_string(_TEMPLATE).render(tables=list(tables))


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
    return "\n".join(_latex_table(one, number, "table*" if wide else "table") for number, one in enumerate(tables, 1))


def _latex_table(table: TextTable, number: int, environment: str) -> str:
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


_ACTS = re.compile(r"[\\|*\[\]~]|(?<![^\W_])_|_(?![^\W_])")
"""Characters to escape: those that are markup anywhere, and underscores at the edge of a word."""


def markdown(parts: Iterable[TextTable | Sequence[str]]) -> str:
    """Return tables, each under its title as a heading, and lists of notes as Markdown."""
    texts = (_markdown_table(one) if isinstance(one, TextTable) else _notes(one) for one in parts)
    return "\n\n".join(map("\n".join, texts)) + "\n"


def _markdown_table(table: TextTable) -> list[str]:
    """Return a table as lines of Markdown: heading, sentences, columns with numbers aligned right, notes."""
    return [
        f"### {markdown_text(table.title)}\n",
        *([f"{markdown_note(table.origin)}\n"] if table.origin else []),
        *(f"{markdown_note(text)}\n" for text in table.summary),
        "| " + " | ".join(markdown_text(name) for name in table.headers) + " |",
        "|" + "|".join("---:" if right else "---" for right in table.right) + "|",
        *("| " + " | ".join(map(markdown_text, line)) + " |" for line in table.lines),
        *(["", *_notes(table.notes)] if table.notes else []),
    ]


def _notes(notes: Sequence[str]) -> list[str]:
    return [f"- {markdown_note(note)}" for note in notes]


def markdown_text(text: str) -> str:
    """Return text escaped for a Markdown table or heading; line breaks become ``<br>``."""
    return "<br>".join(_escaped(line).replace("`", "\\`") for line in text.split("\n"))


def markdown_note(text: str) -> str:
    """Return a sentence escaped for Markdown; words between backticks stay code."""
    return _escaped(text.strip())


def _escaped(text: str) -> str:
    escaped = _ACTS.sub(r"\\\g<0>", text.replace("\n", " "))
    return escaped.replace("&", "&amp;").replace("<", "&lt;")
