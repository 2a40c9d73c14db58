"""``tactbench import``: foreign tables, and logs of devices, become recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from tactbench.core.cli.screen import remark
from tactbench.core.tables.text import command_line, visible

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tactbench.core.recording.device_log import ImportedLog
    from tactbench.core.recording.health import Finding
    from tactbench.core.recording.mapping import ImportReport

MOST_NAMED = 12
"""Findings that are printed, the worst first."""
PAIRS = "KEY=VALUE"


@click.command(name="import")
@click.argument("source", metavar="MAPPING|LOG", type=click.Path(path_type=Path))
@click.option("--root", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder of the data set. Default: that of the mapping.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR|FILE",
              help="Output folder; of a log, the output file. Default: recordings/NAME[.h5].")  # fmt: skip
@click.option("--replace", is_flag=True, help="Overwrite recordings that hold something else.")
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
    """Convert foreign tables, as MAPPING (a YAML file) says, or with --sensor a LOG, into recordings.

    All of them are written, or none. What was marked as "no sample" is counted. See docs/mappings.md. Exit code 1 if
    what was written has an error, as `inspect` finds them.
    """
    if sensor is None:
        if options or labels:
            raise click.UsageError("--option and --label are for logs: name the --sensor.")
        sound = _import_tables(source, root, out, replace)
        ctx.exit(0 if sound else 1)
    if root is not None:
        raise click.UsageError("--root is for mappings: leave it out, or --sensor.")
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.recording.device_log import import_log
    from tactbench.core.spec.scene import Role

    target = Path("recordings") / f"{source.stem}.h5" if out is None else out
    named = _pairs("--label", labels)
    session, role = str(named.pop("session", "1")), named.pop("role", None)
    if role is not None and role not in get_args(Role):
        raise click.UsageError(f"--label role={role}: one of {', '.join(get_args(Role))} is expected.")
    made = import_log(
        source, load_registry().sensors[sensor], _pairs("--option", options), out=target, session=session, role=role,
        labels=named, replace=replace,
    )  # fmt: skip
    for line in log_summary(made, target):
        click.echo(visible(line))
    remark(f"See what is in it:  {command_line('tactbench', 'inspect', str(target))}")
    ctx.exit(0 if _sound(made.findings) else 1)


def _sound(findings: Iterable[Finding]) -> bool:
    return all(finding.severity != "error" for finding in findings)


def _import_tables(mapping: Path, root: Path | None, out: Path | None, replace: bool) -> bool:
    """Return whether no recording has an error."""
    from tactbench.core.cli.progress import progress
    from tactbench.core.recording.mapping import import_tables

    target = Path("recordings") / mapping.stem if out is None else out
    with progress() as display:
        begun = False

        def tell(_done: int, total: int, what: str) -> None:
            nonlocal begun
            if not begun:
                display.begin("importing", total)
                begun = True
            display.advance(what)

        report = import_tables(mapping, root=root, out=target, progress=tell, replace=replace)
    for line in summary(report, target):
        click.echo(visible(line))
    return _sound(finding for recording in report.recordings for finding in recording.findings)


def _pairs(option: str, given: tuple[str, ...]) -> dict[str, Any]:
    """Return ``key=value`` pairs; values are read as YAML reads a number, a truth value or a text."""
    from tactbench.core.spec.yaml_file import plain_value

    found: dict[str, Any] = {}
    for text in given:
        key, separator, value = text.partition("=")
        if not separator or not key or key in found:
            raise click.UsageError(f"{option} {text!r}: {PAIRS} is expected, each key once.")
        found[key] = plain_value(value)
    return found


def log_summary(made: ImportedLog, out: Path) -> list[str]:
    """Return what became of a log, line by line."""
    meta = made.meta
    rows = ", ".join(f"{number} rows of {stream}" for stream, number in made.rows.items())
    lines = [f"{out}: {meta.sensor.name} from {meta.origin}, {rows}; clock {meta.clock}"]
    lines += [f"  {name}: {number}" for name, number in meta.counts.items()]
    lines += [f"  {finding.severity}: {finding.message}" for finding in made.findings]
    return lines + [f"  remark: {remark}" for remark in meta.remarks]


def summary(report: ImportReport, folder: Path) -> list[str]:
    """Return what an import did, line by line."""
    from collections import Counter

    from tactbench.core.spec.declared_task import FILE

    lines = [
        f"{report.title}: {len(report.recordings)} recordings of {', '.join(report.sensors)}, {report.rows} rows, "
        f"from {report.files_read} files, in {folder}"
    ]
    if report.tasks:
        lines.append(f"  tasks of their own, in {folder / FILE}: {', '.join(report.tasks)}")
    if report.missing:
        counts = ", ".join(f"{channel} {count}" for channel, count in report.missing.items())
        lines.append(f"  rows without a sample, marked and left out of every evaluation: {counts}")
    for reason, count in report.excluded.items():
        names = [recording.name for recording in report.recordings if recording.excluded == reason]
        shown = ", ".join(names[:3]) + (" …" if count > 3 else "")
        lines.append(f"  {count} recordings are marked as excluded ({shown}): {reason}")
    found = Counter(
        (finding.severity, finding.message)
        for recording in report.recordings
        for finding in recording.findings
        if finding.check not in ("missing", "excluded")
    )
    order = ("error", "warning", "info")
    worst = sorted(found.items(), key=lambda item: (order.index(item[0][0]), -item[1]))
    for (severity, message), count in worst[:MOST_NAMED]:
        where = f" (in {count} of {len(report.recordings)} recordings)" if len(report.recordings) > 1 else ""
        lines.append(f"  {severity}: {message}{where}")
    if len(worst) > MOST_NAMED:
        lines.append(f"  … and {len(worst) - MOST_NAMED} more remarks; see `tactbench inspect`")
    return lines
