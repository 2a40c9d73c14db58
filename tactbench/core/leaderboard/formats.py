"""The leaderboard in the formats that people, papers, pages and programs read; each shows the same digits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard.names import Row
from tactbench.core.leaderboard.records import csv_text, json_array, parquet, xlsx
from tactbench.core.leaderboard.sentences import NO_BETTER
from tactbench.core.leaderboard.table import Block, Table, build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, WHOLE, View, document, grids
from tactbench.core.statistics.replicates import counted
from tactbench.core.tables import markdown as markdown_format
from tactbench.core.tables import terminal
from tactbench.core.tables.latex import latex_table
from tactbench.core.tables.numbers import whole
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

SUFFIXES = {
    ".json": "json", ".csv": "csv", ".md": "md", ".tex": "latex", ".parquet": "parquet", ".xlsx": "xlsx",
    ".txt": "table",
}  # fmt: skip
"""The format that a file is meant to have, by how its name ends."""
IN_FOLDER = ("md", "csv", "json")
"""A run's result folder has these, ``leaderboard.md`` and so on; the others are made when asked for."""
_IN_A_PAPER = ("sensor", "estimator", "score", "interval", "published")
_LONG = 12
"""Letters of a name in a paper from which its column breaks it."""


def plain_text(table: Table, width: int = 240, view: View = DEFAULT_VIEW) -> str:
    """Return what a terminal without colours shows."""
    return terminal.plain_text(document(table, view), width)


def markdown(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return a leaderboard as Markdown, a heading a block, with its provenance."""
    parts: list[TextTable | Sequence[str]] = [*grids(table, view), *table.sections]
    parts += [table.footer] if table.footer else []
    return markdown_format.markdown(parts)


def latex(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return the blocks as LaTeX, each a table for one column of a paper; what was probed goes over both."""
    names = view.columns or _IN_A_PAPER
    blocks = zip(table.blocks, grids(table, replace(view, wide=False, columns=())), strict=True)
    parts = [_in_a_paper(block, grid, names, number) for number, (block, grid) in enumerate(blocks, 1)]
    parts += [latex_table(one, number=number) for number, one in enumerate(table.sections, len(parts) + 1)]
    return "\n".join(parts)


def _in_a_paper(block: Block, grid: TextTable, names: Sequence[str], number: int) -> str:
    """Return a block as LaTeX; a paper gives no commands, and no places unless they were asked for."""
    # Cells without a score stand above the rule: trivial answers alone are below it.
    order = sorted(range(len(grid.lines)), key=lambda place: grid.kinds[place] == "baseline")
    lines = [dict(zip(grid.columns, grid.lines[place], strict=True)) for place in order]
    marked = [line.get("notes") or (NO_BETTER if line.get("place") == NO_BETTER else "") for line in lines]
    names = [name for name in names if name in grid.columns and name != "notes"]
    shown = (tuple(line[name].replace(" … ", "–") for name in names) for line in lines)
    heads = dict(zip(grid.columns, grid.headers, strict=True))
    table = replace(
        grid,
        title=_caption(block),
        columns=(*names, "notes"),
        headings=(*("\n".join(heads[name].rsplit(" ", 1)) for name in names), ""),
        lines=tuple((*line, mark) for line, mark in zip(shown, marked, strict=True)),
        notes=tuple(f"{note.text.rstrip('.')}." for note in block.notes if note.printed),
    ).compact()
    trivial = grid.kinds.count("baseline")
    rule = len(lines) - trivial if 0 < trivial < len(lines) else None
    columns = "".join(map(_column, table.columns, zip(*table.lines, strict=True)))
    return latex_table(table, number=number, columns=f"@{{}}{columns}@{{}}", rule=rule)


def _column(name: str, texts: Sequence[str]) -> str:
    """Return how LaTeX sets a column: long names go on in a further line."""
    if name not in ("sensor", "estimator", "notes"):
        return "r"
    return r"p{0.23\columnwidth}" if max(map(len, texts)) > _LONG else "l"


def _caption(block: Block) -> str:
    """Return the title of a block, its setting, where it comes from, and how many samples and what intervals are of."""
    rows = [line.row for line in block.lines if line.kind == "result"]
    counts = sorted({row["n_test"] for row in rows if row["n_test"] is not None})
    over = {
        (int(row["n_replicates"]), visible(str(row["replicate_unit"])))
        for row in rows
        if row["ci_low"] is not None and row.get("n_replicates")
    }
    sentences = [block.title, f"Score: {block.setting.replace(' · ', ', ')}", block.origin]
    if counts:
        sentences.append(f"n = {'–'.join(map(whole, dict.fromkeys((counts[0], counts[-1]))))} test samples")
    if len(over) == 1:
        number, unit = over.pop()
        sentences.append(f"Intervals are over {counted(number, 'campaign' if unit == 'replicate' else unit)}")
    if any(line.kind == "baseline" for line in block.lines):
        sentences.append("Below the rule: trivial answers")
    return " ".join(sentence if sentence.endswith("?") else f"{sentence}." for sentence in sentences)


def rendered(table: Table, shape: str, view: View = WHOLE, width: int = 240) -> bytes:
    """Return a leaderboard in a format that `SUFFIXES` names.

    Parameters
    ----------
    view, width
        What is printed of it for people, and how wide a terminal is; the formats for programs hold everything.

    Raises
    ------
    UsageError
        If Parquet or Excel is asked for and its library is not installed.
    """
    if shape == "table":
        return plain_text(table, width, view).encode("utf-8", "backslashreplace")
    if shape in ("parquet", "xlsx"):
        return parquet(table) if shape == "parquet" else xlsx(table)
    if shape in ("md", "latex"):
        text = markdown(table, view) if shape == "md" else latex(table, view)
    else:
        text = csv_text(table) if shape == "csv" else json_array(table)
    return text.encode("utf-8", "replace")


def write_tables(
    rows: Sequence[Row], folder: Path, provenance: Sequence[Row] = (), table: Table | None = None
) -> tuple[Path, ...]:
    """Write the leaderboard of `rows`, or `table` where it has been made, into a result folder; return the files.

    Raises
    ------
    UsageError
        If the folder cannot be written; each of the files is then whole, an old one or a new one.
    """
    table = table or build_table(rows, provenance)
    paths = {folder / f"leaderboard.{shape}": shape for shape in IN_FOLDER}
    try:
        for path, shape in paths.items():
            replace_file(path, rendered(table, shape))
    except OSError as error:
        raise UsageError(
            f"The tables cannot be written to {folder}: {error.strerror or error}.",
            hint="Make room or give another folder; the results themselves are safe.",
        ) from error
    return tuple(paths)
