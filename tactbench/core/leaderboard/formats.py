"""The table in the formats that papers, pages and programs read."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard import probe
from tactbench.core.leaderboard.table import NUMERIC, Table, build_table

Row = Mapping[str, Any]

JSON_KEYS = (
    "cell", "sensor", "task", "rig", "protocol", "split", "estimator", "params", "is_baseline", "repeat", "repeats",
    "seed", "status", "reason", "signal", "metric", "unit", "score", "ci_low", "ci_high", "ci_method", "baseline",
    "published", "published_reference", "published_remark", "n_recordings", "n_sessions", "n_train", "n_test", "sim_s",
    "search_s", "fit_s", "predict_s", "batch_rows", "latency_ms_p50", "latency_ms_p95", "latency_n", "threads",
    "peak_rss_mb", "wall_s", "concurrency", "host", "made_by", "simulated", "dagger", "stamps", "remarks",
    "assumptions", "counts", "chosen", "search", "scores", "confusion", "classes", "recordings", "key", "replicates",
)  # fmt: skip
"""Keys of a JSON row, in order."""

_NESTED = frozenset(
    {
        "params",
        "stamps",
        "remarks",
        "assumptions",
        "counts",
        "chosen",
        "search",
        "scores",
        "confusion",
        "classes",
        "recordings",
        "replicates",
    }
)


def to_json(rows: Sequence[Row]) -> str:
    """Return the rows as a JSON array, every key in every row."""
    return json.dumps([{key: row.get(key) for key in JSON_KEYS} for row in rows], indent=1, ensure_ascii=False) + "\n"


def to_csv(rows: Sequence[Row]) -> str:
    """Return the rows as CSV; lists and tables inside a cell are JSON."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(JSON_KEYS)
    for row in rows:
        values = []
        for key in JSON_KEYS:
            value = row.get(key)
            values.append(json.dumps(value) if key in _NESTED else "" if value is None else value)
        writer.writerow(values)
    return out.getvalue()


def to_markdown(rows: Sequence[Row]) -> str:
    """Return the table as Markdown, a heading a block."""
    table = build_table(rows)
    parts: list[str] = []
    for block in table.blocks:
        parts += [*markdown_grid(block.title, table.columns, NUMERIC, [line.cells for line in block.lines]), ""]
    parts += [f"- {markdown_text(note)}" for note in table.notes]
    probed = probe.build_probe(rows)
    if probed is not None:
        parts += ["", *markdown_grid(probed.title, probed.columns, probe.NUMERIC, probed.lines)]
        parts += ["", *(f"- {markdown_text(note)}" for note in probed.notes)]
    return "\n".join(parts) + "\n"


def markdown_grid(
    title: str, columns: Sequence[str], numeric: Collection[str], lines: Iterable[Iterable[str]]
) -> list[str]:
    """Return a heading and a table as lines of Markdown, columns of numbers to the right."""
    return [
        f"### {markdown_text(title)}\n",
        "| " + " | ".join(markdown_text(name) for name in columns) + " |",
        "|" + "|".join("---:" if name in numeric else "---" for name in columns) + "|",
        *("| " + " | ".join(markdown_text(cell) for cell in line) + " |" for line in lines),
    ]


def markdown_text(text: str) -> str:
    """Return text that no table of Markdown breaks at."""
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")


def to_latex(rows: Sequence[Row]) -> str:
    """Return the table as LaTeX for the booktabs package, a table a block."""
    table = build_table(rows)
    parts: list[str] = []
    for block in table.blocks:
        lines = [line.cells for line in block.lines]
        parts += _latex_grid(block.title, table.columns, NUMERIC, lines, _notes_of(table, block.title))
    probed = probe.build_probe(rows)
    if probed is not None:
        parts += _latex_grid(probed.title, probed.columns, probe.NUMERIC, probed.lines, probed.notes)
    return "\n".join(parts) + "\n"


def _latex_grid(
    title: str,
    columns: Sequence[str],
    numeric: Collection[str],
    lines: Iterable[Iterable[str]],
    notes: Iterable[str],
) -> list[str]:
    alignment = "".join("r" if name in numeric else "l" for name in columns)
    return [
        r"\begin{table}",
        rf"\caption{{{_tex(title)}}}",
        rf"\begin{{tabular}}{{{alignment}}}",
        r"\toprule",
        " & ".join(_tex(name) for name in columns) + r" \\",
        r"\midrule",
        *(" & ".join(_tex(cell) for cell in line) + r" \\" for line in lines),
        r"\bottomrule",
        r"\end{tabular}",
        *(rf"\par\footnotesize {_tex(note)}" for note in notes),
        r"\end{table}",
        "",
    ]


def _notes_of(table: Table, title: str) -> tuple[str, ...]:
    return table.notes if table.blocks and table.blocks[-1].title == title else ()


_TEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "†": r"$\dagger$", "‡": r"$\ddagger$", "–": "--",
    "…": r"\ldots{}", "·": r"$\cdot$", "µ": r"$\mu$", "²": r"$^2$", "\n": " ", "\u202f": r"\,",
}  # fmt: skip


def _tex(text: str) -> str:
    return "".join(_TEX.get(character, character) for character in text)


def to_page(rows: Sequence[Row]) -> str:
    """Return the leaderboard as one HTML file, every cell behind its numbers."""
    from tactbench.core.leaderboard.board.page import to_html

    return to_html(rows)


FORMATS: dict[str, Callable[[Sequence[Row]], str]] = {
    "json": to_json,
    "csv": to_csv,
    "md": to_markdown,
    "latex": to_latex,
    "html": to_page,
}
"""Formats that are plain text, by their name on the command line."""
