"""``tactbench check``: checks that a plugin conforms to the rules for plugins."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

import tactbench
from tactbench.core.cli.shared import format_option, print_fields, print_records
from tactbench.core.conformance.check import CHECKS, KINDS
from tactbench.core.conformance.run import CheckReport, plugins_named, run_checks, subjects_named
from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.leaderboard.names import grouped
from tactbench.core.plugins.registry import load_registry
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import json_text


@click.command(name="check")
@click.argument("name", required=False)
@click.option("--list", "listed", is_flag=True, help="List the checks with their purpose and kinds of plugins.")
@click.option("--recording", type=click.Path(path_type=Path, exists=True, dir_okay=False), metavar="FILE",
              help="Also check this recording of the sensor.")  # fmt: skip
@click.option("--root", type=click.Path(path_type=Path, exists=True, file_okay=False), metavar="DIR",
              help="Folder with the files of a data set. Default: the files fetched before.")  # fmt: skip
@format_option("table", "json")
@click.pass_context
def command(
    ctx: click.Context, name: str | None, listed: bool, recording: Path | None, root: Path | None, shape: str
) -> None:
    """Check that a plugin conforms: a sensor, rig, device, task, estimator, effect, indenter, profile or data set.

    NAME is the name of a component, a mapping file, or a plugin with all its components. No device is
    opened and nothing moves. Exit code 1 if a check failed, 2 if nothing is called NAME.
    """
    if listed:
        checks = [{"check": one.name, "of": "all" if one.kinds == KINDS else ", ".join(one.kinds),
                   "why": one.why, "do": one.cure} for one in CHECKS]  # fmt: skip
        print_records(checks, shape, title="checks", columns=("check", "of", "why"))
        return
    if name is None:
        raise UsageError("No NAME of a plugin was given.", hint="`tactbench list plugins` shows the names.")
    registry = load_registry()
    wrong = [f"{row.entry_point}: {row.reason}" for row in plugins_named(registry, name) if row.status == "failed"]
    try:
        subjects = subjects_named(registry, name)
    except UnknownNameError as error:
        wrong = [f"{row.entry_point}: {row.reason}" for row in registry.failures] + list(map(str, registry.refused))
        if not wrong:
            raise
        subjects = []
        remark(error.message)
    if recording is not None and not wrong and all(one.kind != "sensor" for one in subjects):
        raise UsageError(f"--recording is for sensors only, and {name} is not a sensor.", hint="Leave out --recording.")
    reports = [run_checks(one, recording=recording, root=root) for one in subjects]
    if shape == "json":
        click.echo(json_text({"failed_plugins": wrong, "checked": [_plain(one) for one in reports]}, indent=1))
    else:
        print_fields([("could not be loaded", text) for text in wrong])
        for report in reports:
            print_fields(list(_lines(report)))
            click.secho(report.summary, bold=True)
    ctx.exit(1 if wrong or not all(one.ok for one in reports) or not reports else 0)


def _plain(report: CheckReport) -> dict[str, object]:
    return {
        "kind": report.kind, "name": report.name, "ok": report.ok, "level": report.level,
        "kit": tactbench.__version__, "checks": [one._asdict() for one in report.outcomes],
    }  # fmt: skip


def _lines(report: CheckReport) -> Iterator[tuple[str, str]]:
    """Yield (label, text) of each failed check, and of the skipped checks grouped by their reason."""
    for one in report.failed:
        yield "FAILED", f"{one.check}: {one.where}: {one.text}"
        if one.advice:
            yield "  do", one.advice
    for text, several in grouped(report.of("skipped"), lambda one: one.text).items():
        yield "skipped", f"{f'{len(several)} checks' if len(several) > 1 else several[0].check}: {text}"
