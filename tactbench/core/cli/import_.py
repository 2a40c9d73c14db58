"""``tactbench import``: converts foreign tables and logs of devices into recordings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import click

from tactbench.core.cli.shared import field_text, print_fields
from tactbench.core.plugins.registry import load_registry
from tactbench.core.recording.mapping.importing import ImportReport, import_log, import_tables
from tactbench.core.spec.scene import Role
from tactbench.core.spec.yaml_file import plain_value
from tactbench.core.study.terminal import progress

MOST_NAMED = 12
"""Largest number of findings, and of files left out, that are printed; the most severe findings come first."""
PAIRS = "KEY=VALUE"


@click.command(name="import")
@click.argument("source", metavar="MAPPING|LOG", type=click.Path(path_type=Path))
@click.option("--root", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder of the data set. Default: the one stated in the mapping.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR|FILE",
              help="Output folder; for a log, the output file. Default: recordings/NAME[.h5].")  # fmt: skip
@click.option("--replace", is_flag=True, help="Overwrite existing recordings with other content.")
@click.option("--sensor", metavar="NAME", help="Read a log of this sensor's own tools.")
@click.option(
    "--option", "options", multiple=True, metavar=PAIRS, help="Option of the log's reader: board=14; repeatable."
)
@click.option("--label", "labels", multiple=True, metavar=PAIRS,
              help="Label of a log's recording: cap_radius_mm=4, session=a, role=test; repeatable.")  # fmt: skip
@click.pass_context
def command(
    ctx: click.Context, source: Path, root: Path | None, out: Path | None, replace: bool, sensor: str | None,
    options: tuple[str, ...], labels: tuple[str, ...],
) -> None:  # fmt: skip
    """Convert foreign tables, as described by MAPPING (a YAML file), or with --sensor a LOG, into recordings.

    Either all recordings are written, or none. Values marked as "no sample" are counted. See docs/mappings.md. Exit
    code 1 if `inspect` finds an error in the recordings.
    """
    if sensor is None:
        if options or labels:
            raise click.UsageError("--option and --label are for logs: give --sensor as well.")
        target = Path("recordings") / source.stem if out is None else out
        with progress() as display:
            report = import_tables(source, root=root, out=target, progress=display, replace=replace)
    else:
        if root is not None:
            raise click.UsageError("--root is for mappings: leave out either --root or --sensor.")
        target = Path("recordings") / f"{source.stem}.h5" if out is None else out
        own, descriptor = _pairs("--label", labels), load_registry().sensors[sensor]
        session, role = str(own.pop("session", "1")), own.pop("role", None)
        if role is not None and role not in get_args(Role):
            raise click.UsageError(f"--label role={role}: one of {', '.join(get_args(Role))} is expected.")
        report = import_log(source, descriptor, _pairs("--option", options), out=target, session=session, role=role,
                            labels=own, replace=replace)  # fmt: skip
    print_fields(list(fields(report, target)))
    ctx.exit(any(finding.severity == "error" for one in report.recordings for finding in one.findings))


def _pairs(option: str, given: tuple[str, ...]) -> dict[str, Any]:
    """Return ``key=value`` options as a dict; values are read as in YAML: a number, a boolean or a text."""
    found: dict[str, Any] = {}
    for text in given:
        key, separator, value = text.partition("=")
        if not separator or not key:
            raise click.UsageError(f"{option} {text!r}: {PAIRS} is expected.")
        found[key] = plain_value(value)
    return found


def fields(report: ImportReport, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield (name, text) pairs that summarise an import: counts, files left out, findings."""
    stated = {
        "title": report.title, "recordings": len(report.recordings), "in": folder,
        "sensors": tuple(dict.fromkeys(one.meta.sensor.name for one in report.recordings)),
        "rows": report.rows, "files": report.files_read, "tasks declared": report.tasks,
        "rows without a sample": dict(report.missing),
    }  # fmt: skip
    yield from ((name, field_text(value)) for name, value in stated.items() if value)
    excluded = Counter(one.meta.excluded for one in report.recordings if one.meta.excluded)
    yield from (("excluded", f"{count} recordings: {reason}") for reason, count in excluded.items())
    yield from (("left out", one) for one in report.left_out[:MOST_NAMED])
    if len(report.left_out) > MOST_NAMED:
        yield "left out", f"{len(report.left_out) - MOST_NAMED} more files without a partner"
    yield from (("not used", one) for one in report.unused)
    found = Counter(
        (finding.severity, finding.message)
        for recording in report.recordings
        for finding in recording.findings
        if finding.check not in ("missing", "excluded", "left-out")
    )
    order = ("error", "warning", "info")
    worst = sorted(found.items(), key=lambda item: (order.index(item[0][0]), -item[1]))
    for (severity, message), n in worst[:MOST_NAMED]:
        yield severity, f"{message} (in {n} recordings)" if len(report.recordings) > 1 else message
    if len(worst) > MOST_NAMED:
        yield "more", f"{len(worst) - MOST_NAMED} findings; see `tactbench inspect`"
