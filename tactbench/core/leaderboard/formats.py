"""The leaderboard in the formats that people, papers, pages and programs read; each shows the same digits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

from tactbench.core.errors import UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard import view as viewed
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.columns import INTERVALS
from tactbench.core.leaderboard.names import Row
from tactbench.core.leaderboard.notes import RANKS, interval_notes
from tactbench.core.leaderboard.records import csv_text, json_array, parquet, xlsx
from tactbench.core.leaderboard.table import Table, build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, WHOLE, View, document
from tactbench.core.tables import markdown as markdown_format
from tactbench.core.tables import terminal
from tactbench.core.tables.fitting import fit, wrapped
from tactbench.core.tables.latex import SEP_PT, latex_table, points, tex
from tactbench.core.tables.numbers import whole
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

if TYPE_CHECKING:
    from rich.console import Console

SUFFIXES = {
    ".json": "json", ".csv": "csv", ".md": "md", ".tex": "latex", ".parquet": "parquet", ".xlsx": "xlsx",
    ".txt": "table",
}  # fmt: skip
"""The format that a file is meant to have, by how its name ends."""
IN_FOLDER = ("md", "csv", "json")
"""A run's result folder has these, ``leaderboard.md`` and so on; the others are made when asked for."""
COLUMN_PT = 229.0
"""Width of one column of a two-column paper, in points: of the class article 229.5, of others 239 (84 mm) and more."""
_IN_A_COLUMN = ("sensor", "estimator", "score", "beyond floor", "95 % interval", "95 % beyond", "published")
_FIRST_TO_GO = ("published", "score")


def show(table: Table, console: Console, view: View = DEFAULT_VIEW) -> None:
    """Print a leaderboard on a terminal."""
    terminal.show(document(table, view), console)


def plain_text(table: Table, width: int = 240, view: View = DEFAULT_VIEW) -> str:
    """Return what a terminal without colours shows."""
    return terminal.plain_text(document(table, view), width)


def markdown(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return a leaderboard as Markdown, a heading a block."""
    return markdown_format.markdown(document(table, view))


def latex(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return the table as LaTeX, a table a block; notes and footer stand below the last block.

    What is printed by default fits one column of a two-column paper; all columns make a table over both.
    """
    parts: list[str] = []
    whole_width = view.wide or bool(view.columns)
    last = len(table.blocks) - 1
    for place, (block, grid) in enumerate(zip(table.blocks, viewed.grids(table, view), strict=True)):
        # A paper's table shows no ranks.
        shown = [note for note in viewed.notes(table, view) if whole_width or note != RANKS]
        notes = [*shown, *viewed.footer(table, view)] if place == last else []
        if not whole_width:
            grid = grid.only([name for name in grid.columns if name in _IN_A_COLUMN])
        grid = replace(grid, title=_caption(block, grid))
        parts += latex_table(grid, notes, number=place) if whole_width else _in_a_column(grid, notes, number=place)
    for number, section in enumerate(viewed.sections(table, view), len(table.blocks)):
        parts += latex_table(section, section.notes, number=number)
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
    sentences = [text.rstrip(".") for text in (block.title, *grid.summary[:1], n, *how, rule) if text]
    return f"{'. '.join(sentences)}."


def _in_a_column(grid: TextTable, notes: Sequence[str], *, number: int) -> list[str]:
    """Return a table as LaTeX: of one column, long texts broken into further lines."""
    places = {name: place for place, name in enumerate(grid.columns)}
    gap = 2 * SEP_PT
    intervals = {places[name] for name in INTERVALS if name in places}
    widths, hidden = fit(
        grid.headers, grid.lines, {places["sensor"], places["estimator"], *intervals}, room=COLUMN_PT - gap, gap=gap,
        measure=points, first_to_go=[places[name] for name in _FIRST_TO_GO if name in places], broken_last=intervals,
    )  # fmt: skip
    if hidden:
        notes = [*notes, f"There was no room for: {', '.join(grid.headers[place] for place in hidden)}."]
    lines = [_broken(cells, widths) for cells in grid.lines]
    begins = [0, *accumulate(map(len, lines))]
    kept = replace(
        grid,
        columns=tuple(grid.columns[place] for place in widths),
        headings=(),
        lines=tuple(line for one in lines for line in one),
    )
    rules = [begins[place] for place in _first_trivial(grid)]
    heads = _broken(grid.headers, widths)
    return latex_table(kept, notes, headings=heads, number=number, over_both=False, rules=rules)


def _first_trivial(grid: TextTable) -> list[int]:
    """Return the place of the first trivial answer, if a table of one column, which shows no ranks, has some."""
    return [grid.kinds.index("baseline")] if "baseline" in grid.kinds and grid.kinds[0] != "baseline" else []


def _broken(cells: Sequence[str], widths: Mapping[int, float]) -> list[tuple[str, ...]]:
    parts: Iterable[list[str]] = (wrapped(cells[place], room, points) for place, room in widths.items())
    return list(zip_longest(*parts, fillvalue=""))


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
