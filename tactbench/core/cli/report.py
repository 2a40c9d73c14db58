"""``tactbench report``: writes the results as one HTML page, with figures and published scores beside ours."""

from __future__ import annotations

from pathlib import Path

import click

from tactbench.core.cli.shared import DEFAULT_FOLDER, print_tables
from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.page import make_report
from tactbench.core.report.results import open_results, published_table
from tactbench.core.study.files import opened
from tactbench.core.study.terminal import progress
from tactbench.core.tables.terminal import remark


@click.command(name="report")
@click.argument("folder", type=click.Path(path_type=Path), default=DEFAULT_FOLDER, required=False)
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder of page and figures. Default: FOLDER/report.")  # fmt: skip
@click.pass_context
def command(ctx: click.Context, folder: Path, out: Path | None) -> None:
    """Write one HTML page of all results in FOLDER (that of `run --out`), and print published scores beside ours."""
    store, out = opened(folder), out or folder / "report"
    results = open_results(store, load_registry())
    with progress() as display:
        page = make_report(results, out, display)
    published = published_table(results.registry, results.rows)
    print_tables([published] if published.lines else [])
    for sentence in (*(f"{folder}: {one}" for one in store.troubles), *page.missing):
        remark(f"Left out: {sentence}")
    for sentence in page.broken:
        remark(f"Failed: {sentence}")
    remark(f"Page: {out / 'index.html'}")
    ctx.exit(1 if page.broken else 0)
