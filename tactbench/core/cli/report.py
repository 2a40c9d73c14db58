"""``tactbench report``: the results as one page, with figures and the published numbers beside ours."""

from __future__ import annotations

from pathlib import Path

import click

from tactbench.core.cli.options import DEFAULT_FOLDER


@click.command(name="report")
@click.argument("folder", type=click.Path(path_type=Path), default=DEFAULT_FOLDER, required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Where page and figures are put; default: FOLDER/report.",
)
@click.pass_context
def command(ctx: click.Context, folder: Path, out: Path | None) -> None:
    """Make one page of all results in FOLDER, which is what `run --out` wrote.

    The published numbers are printed beside ours.
    """
    from tactbench.core.cli.grid import print_tables
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.report.page import make_report
    from tactbench.core.report.results import open_results
    from tactbench.core.study.progress import progress
    from tactbench.core.study.results import opened
    from tactbench.core.tables.terminal import remark

    store = opened(folder)
    results = open_results(store, load_registry())
    for sentence in store.troubles:
        remark(f"{folder}: {sentence}")
    with progress() as display:
        made = make_report(results, out or folder / "report", display)
    print_tables([table for table in [made.reproduction] if table.lines])
    for sentence in made.missing:
        remark(f"Left out: {sentence}")
    for sentence in made.broken:
        remark(f"Failed: {sentence}")
    remark(f"Page: {made.page}")
    ctx.exit(1 if made.broken else 0)
