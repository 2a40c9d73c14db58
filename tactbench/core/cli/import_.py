"""``tactbench import``: foreign tables become recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from tactbench.core.recording.mapping import ImportReport


@click.command(name="import")
@click.argument("mapping", type=click.Path(path_type=Path))
@click.option("--root", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder of the data set; default: that of the mapping file.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder of the recordings; default: recordings/<name of the mapping>.")  # fmt: skip
@click.option("--replace", is_flag=True, help="Replace recordings of the same name that hold something else.")
def command(mapping: Path, root: Path | None, out: Path | None, replace: bool) -> None:
    """Turn foreign tables into recordings, as MAPPING (a YAML file) says.

    All of them are written, or none. What was marked as "no sample" is counted. See docs/mappings.md.
    """
    from tactbench.core.cli.progress import progress
    from tactbench.core.recording.mapping import import_tables

    target = Path("recordings") / mapping.stem if out is None else out
    with progress() as told:
        begun = False

        def tell(_done: int, total: int, what: str) -> None:
            nonlocal begun
            if not begun:
                told.begin("importing", total)
                begun = True
            told.advance(what)

        report = import_tables(mapping, root=root, out=target, progress=tell, replace=replace)
    for line in summary(report, target):
        click.echo(line)


def summary(report: ImportReport, folder: Path) -> list[str]:
    """Return what an import did, line by line."""
    from collections import Counter

    lines = [
        f"{report.title}: {len(report.recordings)} recordings of {report.sensor}, {report.rows} rows, "
        f"from {report.files_read} files, in {folder}"
    ]
    for recording in report.recordings:
        for channel, count in recording.missing.items():
            lines.append(
                f"  {recording.name}: {channel} has no sample in {count} of {recording.rows} rows; they are marked, "
                "and no evaluation uses them"
            )
    for reason, count in report.excluded.items():
        names = [recording.name for recording in report.recordings if recording.excluded == reason]
        shown = ", ".join(names[:3]) + (" …" if count > 3 else "")
        lines.append(f"  {count} recordings are marked as excluded ({shown}): {reason}")
    told = ("missing", "excluded")
    found = Counter(
        (finding.severity, finding.message)
        for recording in report.recordings
        for finding in recording.findings
        if finding.check not in told
    )
    for (severity, message), count in found.most_common(12):
        where = f" (in {count} of {len(report.recordings)} recordings)" if len(report.recordings) > 1 else ""
        lines.append(f"  {severity}: {message}{where}")
    if len(found) > 12:
        lines.append(f"  … and {len(found) - 12} more remarks; see `tactbench inspect`")
    return lines
