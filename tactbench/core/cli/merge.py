"""``tactbench merge``: merges the result folders of several machines into one folder."""

from __future__ import annotations

from pathlib import Path

import click

from tactbench.core.leaderboard.formats import write_tables
from tactbench.core.matrix.merge import merge
from tactbench.core.matrix.store import Store
from tactbench.core.study.files import shown_rows, table_of
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import command_line


@click.command(name="merge")
@click.argument("folders", type=click.Path(path_type=Path), nargs=-1, required=True, metavar="DIR…")
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="DIR",
              help="The merged folder; it must not exist yet.")  # fmt: skip
@click.pass_context
def command(ctx: click.Context, folders: tuple[Path, ...], out: Path) -> None:
    """Merge several result folders into one; the order of the folders, and repeated folders, make no difference.

    Replicates with other seeds are added. Folders that contradict each other are refused, and the cells in question
    are listed. If two hosts have finished a cell with the same scores, one host's row is kept whole: times of
    different hosts are never mixed.
    """
    merged = merge(folders, out, also=_write_tables)
    remark(f"{len(merged.rows)} cells, {merged.recordings} recordings.")
    for sentence in merged.left_out:
        remark(f"Left out: {sentence}")
    click.echo(out)
    remark(f"Show the table: {command_line('tactbench', 'leaderboard', str(out))}")
    ctx.exit(1 if merged.left_out else 0)


def _write_tables(merged: Path) -> None:
    """Write ``leaderboard.md``, ``.csv`` and ``.json`` into a merged result folder."""
    store = Store(merged)
    write_tables(table_of(store, shown_rows(store)), merged)
