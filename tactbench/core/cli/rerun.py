"""``tactbench rerun``: one cell once more from scratch, held against what lies in the result folder."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.threads import keep_threads
from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.cli.cells import StoredCell
    from tactbench.core.matrix.rerun import Repeated


@click.command(name="rerun")
@click.argument("cell", metavar="CELL")
@click.option("--out", type=click.Path(path_type=Path), default=Path("tactbench-results"), show_default=True,
              metavar="DIR", help="The result folder; nothing in it is changed.")  # fmt: skip
@click.option("--format", "shape", type=click.Choice(("text", "json")), default="text", show_default=True)
@click.pass_context
def command(ctx: click.Context, cell: str, out: Path, shape: str) -> None:
    """Compute one cell again and say whether it comes out the same, bit for bit.

    CELL is its name as tables show it, or a part that only one cell has. What a simulation recorded
    is recorded again, into a place of its own; other cells are answered from the same recordings.

    Exit code 0: identical; 1: something differs, or it fails; 2: usage.
    """
    keep_threads()
    from tactbench.core.cli.cells import find_cell
    from tactbench.core.cli.screen import remark

    found = find_cell(out, cell)
    if found.row is not None and found.row.get("signal") is not None:
        remark(f"It was ended by signal {found.row['signal']} before; it is computed in this process now.")
    again = _compute(found)
    circumstances = list(found.explain().reasons)
    facts = {
        "cell": found.cell.name,
        "answer": "identical" if again.identical else "different",
        "recordings_made": again.recordings,
        "status": again.row["status"],
        "reason": again.row["reason"],
        "traceback": again.row["traceback"],
        "score": again.row["score"],
        "differences": list(again.differences),
        "circumstances": circumstances,
    }
    click.echo(json_text(facts, indent=1) if shape == "json" else _text(facts))
    ctx.exit(0 if again.identical else 1)


def _compute(found: StoredCell) -> Repeated:
    from tactbench.core.cli.cells import recordings_of
    from tactbench.core.cli.progress import progress
    from tactbench.core.matrix.rerun import compute_again

    row = found.row or {}
    paths = () if found.requests else recordings_of(row, found.store)
    with redirect_stdout(sys.stderr), progress() as display:  # what a plugin prints is no result
        return compute_again(found.cell, row, found.store, found.registry, paths, display)


def _text(facts: dict[str, Any]) -> str:
    lines = [facts["cell"]]
    if facts["answer"] == "identical":
        made = facts["recordings_made"]
        lines.append(f"identical: {f'{made} recordings, ' if made else ''}answers, scores and intervals, bit for bit.")
    else:
        lines.append("different:" if facts["differences"] else f"{facts['status']} again, as before: {facts['reason']}")
        lines += [f"  {difference}" for difference in facts["differences"]]
        lines += [f"  {line}" for line in facts["traceback"].splitlines()]
    if facts["circumstances"]:
        lines.append("Since the cell was made, this has changed:")
        lines += [f"  {reason}" for reason in facts["circumstances"]]
    return "\n".join(lines)
