"""``tactbench why``: shows the data behind a cell's score, its status and reuse; computes the cell again."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.shared import RESULTS, field_text, format_option, print_fields, print_tables
from tactbench.core.matrix.why import StoredCell, stored_cell
from tactbench.core.report.results import details, recording_scores
from tactbench.core.statistics.replicates import over_replicates
from tactbench.core.study.files import opened
from tactbench.core.study.terminal import progress
from tactbench.core.tables.text import command_line, cut, json_text, visible_lines

_LINES = 15
"""Largest number of lines of a traceback, log or table that are printed; JSON output has all lines."""
_LONGEST = 400
"""Largest number of characters of a value that are printed."""


@click.command(name="why")
@click.argument("cell", metavar="CELL")
@RESULTS
@click.option("--again", is_flag=True, help="Compute the cell again and compare it, bit for bit; changes nothing.")
@format_option("text", "json")
@click.pass_context
def command(ctx: click.Context, cell: str, out: Path, again: bool, shape: str) -> None:
    """Show the data behind a cell's score, its status, and whether its result would be reused.

    CELL is a name as tables show it, or a unique part of it. Reuse and --again refer to the first of the cell's
    replicates. With --again, simulated recordings are made anew in a temporary folder, and the exit code is 1 if a
    result differs or the cell fails.
    """
    found = stored_cell(opened(out), cell)
    facts = _again(found) if again else _facts(found)
    if shape == "json":
        click.echo(json_text(facts, indent=1))
    else:
        (_print_again if again else _print)(facts, found)
    ctx.exit(1 if again and facts["answer"] != "identical" else 0)


def _facts(found: StoredCell) -> dict[str, Any]:
    """Return the row of the first replicate, with the reasons, if any, why a run would not reuse the result."""
    row = found.row
    reasons = found.changes()
    done = row["status"] == "done"
    return {
        **row, "cell": found.cell.name, "answer": "hit" if done and not reasons else "miss", "reasons": reasons,
        "file": str(found.store.file_of(row)),
        "recording_scores": recording_scores(row, found.store.answers(str(row["key"])).get("test")),
        "try": command_line("tactbench", "why", found.cell.name, "--again", "--out", str(found.store.folder)),
    }  # fmt: skip


def _print(facts: dict[str, Any], found: StoredCell) -> None:
    """Print the facts, and the details of the cell over all replicates, as in the report."""
    name = found.cell.name.removesuffix(f"/{found.cell.seed}")
    (row,) = over_replicates([row for row in found.store.rows() if row["cell"].rpartition("/")[0] == name])
    known = details(row, found.store.answers(str(row["key"])).get("test"))
    reuse = "reuses it" if facts["answer"] == "hit" else "computes it again"
    fields = [("cell", facts["cell"]), ("tactbench run", reuse), *(("changed", text) for text in facts["reasons"])]
    print_fields([*fields, ("file", facts["file"])])
    for title, pairs in known.pairs.items():
        click.secho(f"\n{title}", bold=True)
        print_fields([(key, cut(text.replace("\n", "; "), _LONGEST)) for key, text in pairs.items()])
    for table in known.tables:
        click.echo()
        print_tables([replace(table, lines=table.lines[:_LINES], kinds=table.kinds[:_LINES])])
    for title, text in known.texts.items():
        click.echo(visible_lines("\n  ".join([f"\n{title}, last lines:", *text.splitlines()[-_LINES:]])))
    click.echo(visible_lines(f"\nTry: {facts['try']}"))


def _again(found: StoredCell) -> dict[str, Any]:
    """Compute the cell again in this process, and return its differences from the stored result."""
    with redirect_stdout(sys.stderr), progress() as display:  # what a plugin prints is no result
        row, differences, recorded = found.again(display)
    return {
        "cell": found.cell.name,
        "answer": "identical" if row["status"] == "done" and not differences else "different",
        "recordings_made": recorded,
        **{name: row[name] for name in ("status", "reason", "traceback", "score")},
        "differences": differences,
        "circumstances": found.changes(),
    }


def _print_again(facts: dict[str, Any], _: StoredCell) -> None:
    texts = {**facts, "traceback": ""}
    print_fields([(name.replace("_", " "), text) for name, one in texts.items() if (text := field_text(one))])
    if facts["traceback"]:
        click.echo(visible_lines(facts["traceback"]))
