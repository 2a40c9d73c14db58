"""From a result folder to the page and its figures on disk."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactbench.core.errors import UnwritableError, UsageError
from tactbench.core.files import replace_file
from tactbench.core.matrix.progress import Progress
from tactbench.core.report.figures.drawing import draw_figures
from tactbench.core.report.page import make_page
from tactbench.core.report.published import published_table, records, reproduce
from tactbench.core.report.results import Results, SavedFigure
from tactbench.core.report.section import ReportData
from tactbench.core.tables.text_table import TextTable

Drawer = Callable[[Results, Path, Progress, Callable[[str], None]], Sequence[SavedFigure]]
"""Takes the results, the folder for figures, where progress goes, and what is called with each figure left out."""


@dataclass(frozen=True)
class Report:
    """A report that has been written, and what it lacks."""

    page: Path
    reproduction: TextTable
    records: Sequence[Mapping[str, Any]]
    """The reproduction table for programs."""
    missing: tuple[str, ...]
    broken: tuple[str, ...]


def make_report(results: Results, out: Path, progress: Progress, *, draw: Drawer = draw_figures) -> Report:
    """Draw the figures and write the page: ``index.html`` and ``figures/`` in `out`.

    Raises
    ------
    UsageError
        If no cell has finished.
    UnwritableError
        If `out` refuses the page or the figures; an earlier page is then still whole.
    """
    if not any(row["status"] == "done" for row in results.rows):
        raise UsageError(
            f"No cell in {results.store.folder} has finished: there is nothing to report.",
            hint="Finish some with `tactbench run --out DIR`.",
        )
    undrawn: list[str] = []
    try:
        (out / "figures").mkdir(parents=True, exist_ok=True)
        drawn = draw(results, out / "figures", progress, undrawn.append)
        page = make_page(ReportData(results, drawn, tuple(undrawn)))
        # A lone surrogate, which JSON may hold, is no UTF-8: a question mark then.
        replace_file(out / "index.html", page.html.encode("utf-8", "replace"))
    except OSError as error:
        raise UnwritableError(
            f"The report cannot be written to {out}: {error.strerror or error}.",
            hint="Give another folder with --out.",
        ) from error
    return Report(
        page=out / "index.html",
        reproduction=published_table(results.registry, results.rows),
        records=records(reproduce(results.registry, results.rows)),
        missing=page.missing,
        broken=page.broken,
    )
