"""The table in the formats that papers, pages and programs read."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard import probe
from tactbench.core.leaderboard.table import NUMERIC, Table, build_table

Row = Mapping[str, Any]

JSON_KEYS = (
    "cell", "sensor", "task", "rig", "protocol", "split", "estimator", "params", "is_baseline", "repeat", "repeats",
    "seed", "status", "reason", "metric", "unit", "score", "ci_low", "ci_high", "ci_method", "baseline", "published",
    "published_reference", "published_remark", "n_recordings", "n_sessions", "n_train", "n_test", "sim_s",
    "search_s", "fit_s", "predict_s", "batch_rows", "latency_ms_p50", "latency_ms_p95", "latency_n", "threads",
    "peak_rss_mb", "simulated", "dagger", "stamps", "remarks", "assumptions", "counts", "chosen", "search", "scores",
    "confusion", "classes", "recordings", "key",
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
    parts = []
    for block in table.blocks:
        parts.append(f"### {_md(block.title)}\n")
        parts.append("| " + " | ".join(table.columns) + " |")
        parts.append("|" + "|".join("---:" if name in NUMERIC else "---" for name in table.columns) + "|")
        parts += ["| " + " | ".join(_md(cell) for cell in line.cells) + " |" for line in block.lines]
        parts.append("")
    parts += [f"- {_md(note)}" for note in table.notes]
    probed = probe.build_probe(rows)
    if probed is not None:
        parts += ["", f"### {_md(probed.title)}\n", "| " + " | ".join(probed.columns) + " |"]
        parts.append("|" + "|".join("---:" if name in probe.NUMERIC else "---" for name in probed.columns) + "|")
        parts += ["| " + " | ".join(_md(cell) for cell in line) + " |" for line in probed.lines]
        parts += ["", *(f"- {_md(note)}" for note in probed.notes)]
    return "\n".join(parts) + "\n"


def to_latex(rows: Sequence[Row]) -> str:
    """Return the table as LaTeX for the booktabs package, a table a block."""
    table = build_table(rows)
    parts = []
    for block in table.blocks:
        alignment = "".join("r" if name in NUMERIC else "l" for name in table.columns)
        parts += [r"\begin{table}", rf"\caption{{{_tex(block.title)}}}", rf"\begin{{tabular}}{{{alignment}}}"]
        parts += [r"\toprule", " & ".join(_tex(name) for name in table.columns) + r" \\", r"\midrule"]
        parts += [" & ".join(_tex(cell) for cell in line.cells) + r" \\" for line in block.lines]
        parts += [r"\bottomrule", r"\end{tabular}"]
        parts += [rf"\par\footnotesize {_tex(note)}" for note in _notes_of(table, block.title)]
        parts += [r"\end{table}", ""]
    probed = probe.build_probe(rows)
    if probed is not None:
        alignment = "".join("r" if name in probe.NUMERIC else "l" for name in probed.columns)
        parts += [r"\begin{table}", rf"\caption{{{_tex(probed.title)}}}", rf"\begin{{tabular}}{{{alignment}}}"]
        parts += [r"\toprule", " & ".join(_tex(name) for name in probed.columns) + r" \\", r"\midrule"]
        parts += [" & ".join(_tex(cell) for cell in line) + r" \\" for line in probed.lines]
        parts += [r"\bottomrule", r"\end{tabular}"]
        parts += [rf"\par\footnotesize {_tex(note)}" for note in probed.notes]
        parts += [r"\end{table}", ""]
    return "\n".join(parts) + "\n"


def _notes_of(table: Table, title: str) -> tuple[str, ...]:
    return table.notes if table.blocks and table.blocks[-1].title == title else ()


def _md(text: str) -> str:
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")


_TEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "†": r"$\dagger$", "‡": r"$\ddagger$", "–": "--",
    "…": r"\ldots{}", "·": r"$\cdot$", "µ": r"$\mu$", "²": r"$^2$", "\n": " ", "\u202f": r"\,",
}  # fmt: skip


def _tex(text: str) -> str:
    return "".join(_TEX.get(character, character) for character in text)


FORMATS: dict[str, Callable[[Sequence[Row]], str]] = {
    "json": to_json,
    "csv": to_csv,
    "md": to_markdown,
    "latex": to_latex,
}
"""Formats that are plain text, by their name on the command line."""
