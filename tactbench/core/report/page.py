"""The report page: one HTML file with all sections, without external files."""

from __future__ import annotations

import base64
import json
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import tactbench
from tactbench.core.errors import UsageError, error_text
from tactbench.core.files import replace_file, writable
from tactbench.core.leaderboard.formats import REASON, grid
from tactbench.core.leaderboard.names import DEFAULT, NUMERIC
from tactbench.core.leaderboard.sensitivity import sensitivity_tables
from tactbench.core.progress import Progress
from tactbench.core.report.datasheet import sensor_table, table_one
from tactbench.core.report.figures.answers import confusion, embedding, prediction_against_time, residuals
from tactbench.core.report.figures.group import Group, Sketch, groups, save, styled
from tactbench.core.report.figures.trade import trade_table
from tactbench.core.report.results import MOST_CELLS, Results, SavedFigure, Section, details, published_table, reproduce
from tactbench.core.spec.task import VectorTarget
from tactbench.core.tables.text import WORDY, command_line, sort_value

TITLE = "tactbench: tactile sensors, what they answer and what it costs"


def answers_section(results: Results) -> Section:
    """Return the first section: the outcome of each leaderboard, and the count of published scores in our intervals."""
    verdicts = [
        f"{one.title} ({one.setting.partition(' · ')[2]}) {one.verdict[0]}"
        for one in results.leaderboard.blocks
        if one.verdict
    ]
    published = Counter(line.verdict for line in reproduce(results.registry, results.rows))
    judged = published["inside"] + published["outside"]
    counts = [f"Published numbers in the interval of ours: {published['inside']} of {judged}."] if judged else []
    simulated = ["SIM: simulated by a twin of the sensor; no sensor was touched."]
    simulated = simulated if any(row["simulated"] for row in results.rows) else []
    return Section(paragraphs=(*simulated, *counts, *verdicts))


def leaderboards_section(results: Results) -> Section:
    """Return the section of leaderboards, with the reasons of failed and skipped cells, and of tables on events."""
    tables = [replace(grid(block, (*DEFAULT, REASON)), numeric=NUMERIC) for block in results.leaderboard.blocks]
    tables += results.leaderboard.sections
    return Section(paragraphs=("A number leads to the details of its cell.",),
                   tables=tuple(table.compact() for table in tables))  # fmt: skip


def published_section(results: Results) -> Section:
    """Return the section with the table of published scores and ours."""
    table = published_table(results.registry, results.rows)
    return Section(tables=(table,) if table.lines else ())


def figures_section(results: Results) -> Section:
    """Return the section of figures."""
    paragraphs = ("The same figures lie beside this page as `figures/*.pdf` and `figures/*.png`.",)
    return Section(paragraphs=paragraphs * bool(results.drawn), pictures=results.drawn, missing=results.undrawn)


def costs_section(results: Results) -> Section:
    """Return the section of accuracy against time, from files written by `tactbench cost`."""
    folder = results.store.folder / "cost"
    tables = []
    for path in sorted(folder.glob("*.json")):
        with suppress(KeyError, TypeError, ValueError):  # twin.json has no such table, nor has a damaged file
            tables.append(trade_table(json.loads(path.read_bytes())))
    pictures = (SavedFigure(path.stem, path.stem, "As drawn by `tactbench cost`.", path)
                for path in sorted(folder.glob("*.png")))  # fmt: skip
    return Section(tables=tuple(tables), pictures=tuple(pictures))


def assumptions_section(results: Results) -> Section:
    """Return the section of sensitivities to assumptions, as computed by `tactbench sensitivity`."""
    specs = {sensor.name: sensor.spec for sensor in results.registry.sensors}
    return Section(tables=tuple(sensitivity_tables(results.store, specs)))


def sensors_section(results: Results) -> Section:
    """Return the section that compares the sensors of the results."""
    known = results.registry.sensors
    names = list(dict.fromkeys(str(row["sensor"]) for row in results.rows))
    missing = tuple(f"{name}: not installed." for name in names if name not in known)
    specs = [known[name].spec for name in names if name in known]
    if not specs:
        return Section(missing=missing)
    table = sensor_table("Sensor comparison", specs, table_one, with_source=True).compact()
    command = command_line("tactbench", "show", *(spec.name for spec in specs), "--all")
    paragraph = f"All parameters of these sensors with their sources: `{command}`."
    return Section(paragraphs=(paragraph,), tables=(table,), missing=missing)


def cells_section(results: Results) -> Section:
    """Return the section with the details of every cell of the leaderboard, unless there are too many."""
    if not results.anchors:
        return Section(paragraphs=(f"These are more than {MOST_CELLS} cells: `tactbench why CELL` has their details.",))
    several = any(row["repeats"] > 1 for row in results.rows)
    paragraphs = ("Of several replicates, key, recordings, candidates and effects are those of the first.",) * several
    rows = [line.row for line in results.leaderboard.lines]
    found = tuple(details(row, results.answers(row).get("test")) for row in rows)
    return Section(paragraphs=paragraphs, details=found)


def about_section(results: Results) -> Section:
    """Return the section with the number of cells by status, and versions, machine and commit of the runs."""
    counts = Counter(str(row["status"]) for row in results.rows)
    statuses = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    return Section(paragraphs=(f"Cells: {statuses}.", *results.leaderboard.footer))


SECTIONS: tuple[tuple[str, str, Callable[[Results], Section]], ...] = (
    ("answers", "What came out", answers_section),
    ("leaderboards", "Leaderboard", leaderboards_section),
    ("reproduction", "Published numbers", published_section),
    ("figures", "Figures", figures_section),
    ("cost", "What accuracy costs in time", costs_section),
    ("assumptions", "What simulated scores rest on", assumptions_section),
    ("sensors", "Sensors (the paper's Table I)", sensors_section),
    ("cells", "Details of each cell", cells_section),
    ("about", "Made by", about_section),
)
"""Anchor, title and function of each section of the page."""

FIGURES: dict[str, tuple[Callable[[Group], Sketch], ...]] = {
    "regression": (prediction_against_time, residuals),
    "vector": (residuals,),
    "classification": (confusion, embedding),
}
"""Drawing functions by kind of task; they raise NotApplicable for a group that cannot have the figure."""


def draw_figures(
    results: Results, folder: Path, progress: Progress, remark: Callable[[str], None]
) -> list[SavedFigure]:
    """Draw every figure that the results permit and save it into `folder` as PDF and PNG.

    `remark` is called with a sentence on each figure that cannot be drawn.

    Returns
    -------
    list of SavedFigure
        Figures by group of comparable cells.
    """
    work: list[tuple[Callable[[Group], Sketch], Group]] = []
    for group in groups(results, remark):
        kind = "vector" if isinstance(group.task.target, VectorTarget) else group.task.kind
        work += [(draw, group) for draw in FIGURES.get(kind, ())]
    drawn: list[SavedFigure] = []
    progress.begin("drawing", len(work))
    with styled():
        for draw, group in work:
            name = draw.__name__.replace("_", " ")
            name += f" of {group.task.name} under {group.row['protocol']}, split {group.row['split']}"
            progress.working(name)
            try:
                sketch = draw(group)
                picture = save(sketch.figure, folder / sketch.name)
                drawn.append(SavedFigure(sketch.name, sketch.title, sketch.caption, picture))
            except Exception as error:  # stops no other figure
                remark(f"No {name}: {error_text(error)}")
            progress.advance(name)
    return drawn


class Page(NamedTuple):
    """The HTML of a report page, and the parts that it lacks."""

    html: str
    missing: tuple[str, ...]
    """One sentence for each missing part of a section."""
    broken: tuple[str, ...]
    """One sentence for each section whose results exist and could not be shown."""


def make_page(results: Results) -> Page:
    """Return the report page; equal results give equal bytes. Empty sections are left out.

    A section that cannot be made is replaced by a sentence with the reason.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    sections: list[Section] = []
    broken: list[str] = []
    for anchor, title, make in SECTIONS:
        try:
            section = make(results)
        except Exception as error:
            reason = f"This section cannot be made from these results: {type(error).__name__}: {error}"
            broken.append(f"{title}: {reason}")
            section = Section(missing=(reason,))
        if section != Section():
            sections.append(replace(section, anchor=anchor, title=title))
    missing = [f"{section.title}: {lacked}" for section in sections for lacked in section.missing]
    loader = PackageLoader("tactbench.core.report", "template")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    environment.filters.update(sort_value=sort_value, picture=lambda path: base64.b64encode(path.read_bytes()).decode())
    template = resources.files("tactbench.core.report") / "template"
    style, script = (Markup((template / name).read_text(encoding="utf-8")) for name in ("page.css", "page.js"))
    html = environment.get_template("page.html").render(
        title=TITLE, version=tactbench.__version__, sections=sections, anchors=results.anchors, wordy=WORDY,
        style=style, script=script,
    )  # fmt: skip
    return Page(f"{html}\n", tuple(one for one in missing if one not in broken), tuple(broken))


def make_report(results: Results, out: Path, progress: Progress) -> Page:
    """Draw the figures and write the report: ``index.html`` and ``figures/`` in `out`.

    Raises
    ------
    UsageError
        If no cell has finished.
    UnwritableError
        If `out` cannot be written; an earlier page then stays complete.
    """
    if not any(row["status"] == "done" for row in results.rows):
        raise UsageError(
            f"No cell in {results.store.folder} has finished: there is nothing to report.",
            hint="Compute results with `tactbench run --out DIR`.",
        )
    undrawn: list[str] = []
    with writable(out):
        (out / "figures").mkdir(parents=True, exist_ok=True)
        drawn = draw_figures(results, out / "figures", progress, undrawn.append)
        page = make_page(replace(results, drawn=tuple(drawn), undrawn=tuple(undrawn)))
        # A lone surrogate, which JSON may hold, is no UTF-8: a question mark then.
        replace_file(out / "index.html", page.html.encode("utf-8", "replace"))
    return page
