"""``tactbench check``: whether a plugin keeps what plugins promise."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import YES, format_option
from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tactbench.core.conformance.check import Subject
    from tactbench.core.conformance.run import CheckReport
    from tactbench.core.spec.rig_file import RigFile


@click.command(name="check")
@click.argument("name", required=False)
@click.option("--list", "listed", is_flag=True, help="List the checks: of what, and why each exists.")
@click.option("--recording", type=click.Path(path_type=Path, exists=True, dir_okay=False), metavar="FILE",
              help="Check this recording of the sensor, importing no code of the plugin.")  # fmt: skip
@click.option("--rig-file", type=click.Path(path_type=Path, exists=True, dir_okay=False), metavar="FILE",
              help="Also open the device's line, or press with the rig, as this file says; prompts first.")  # fmt: skip
@click.option("--root", type=click.Path(path_type=Path, exists=True, file_okay=False), metavar="DIR",
              help="Folder that holds the files of a data set; without it those that were fetched.")  # fmt: skip
@YES
@click.option("--out", type=click.Path(path_type=Path, exists=True, file_okay=False), metavar="DIR",
              help="Store a sensor's level in this result folder: its tables show it. Runs all checks.")  # fmt: skip
@format_option("table", "json")
@click.pass_context
def command(
    ctx: click.Context, name: str | None, listed: bool, recording: Path | None, rig_file: Path | None,
    root: Path | None, yes: bool, out: Path | None, shape: str,
) -> None:  # fmt: skip
    """Check whether a plugin conforms: a sensor, rig, device, task, estimator, effect, indenter, profile or data set.

    NAME is one of these, a mapping file, or a plugin: then all it brings is checked. Without --rig-file nothing is
    opened and nothing moves. Exit code 1 if a check failed, 2 if nothing is called NAME.
    """
    from tactbench.core.cli.grid import print_fields
    from tactbench.core.conformance.check import CHECKS, KINDS, Mode
    from tactbench.core.conformance.run import plugins_named, run_checks, subjects_named
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.plugins.rigs import load_rig_file
    from tactbench.core.study.operator import TerminalOperator
    from tactbench.core.study.results import opened
    from tactbench.core.tables.text import json_text

    if listed:
        of = [(one, "all" if one.kinds == KINDS else ", ".join(one.kinds)) for one in CHECKS]
        if shape == "json":
            click.echo(json_text([{"check": one.name, "of": kinds, "mode": one.mode, "why": one.why, "do": one.cure}
                                  for one, kinds in of], indent=1))  # fmt: skip
        else:
            print_fields([(one.name, f"{kinds}: {one.why}") for one, kinds in of])
        return
    if name is None:
        raise UsageError("No NAME was given.", hint="`tactbench list plugins` shows what there is.")
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
    sensors = [one for one in subjects if one.kind == "sensor"]
    if (recording or out) and not sensors and not wrong:
        raise UsageError(f"{name} is no sensor.", hint="--recording and --out are for sensors: leave them out.")
    modes: list[Mode] = ["passive"] if out is not None or recording is None else []
    if recording is not None:
        modes.append("recording")
        subjects = sensors
    if out is not None:
        opened(out)
    if rig_file is not None:
        modes.append("invasive")
        _ask(subjects, load_rig_file(rig_file, registry), yes)
    operator = TerminalOperator(yes=yes)
    reports = []
    for one in subjects:
        report = run_checks(one, modes=modes, recording=recording, rig_file=rig_file, operator=operator, root=root)
        reports.append(report)
        if out is not None and one.kind == "sensor":
            _keep(out, one, report)
    if shape == "json":
        click.echo(json_text({"failed_plugins": wrong, "checked": [_plain(one) for one in reports]}, indent=1))
    else:
        print_fields([("could not be loaded", text) for text in wrong])
        for report in reports:
            print_fields(list(_lines(report)))
            click.secho(report.summary, bold=True)
    ctx.exit(1 if wrong or not all(one.ok for one in reports) or not reports else 0)


def _ask(subjects: Sequence[Subject], file: RigFile, yes: bool) -> None:
    """Say what is about to be opened and moved, and wait for a yes; raises UsageError without a terminal."""
    from tactbench.core.conformance.press import REAL_N
    from tactbench.core.errors import UsageError

    rigs = [one.name for one in subjects if one.kind == "rig"]
    if len(rigs) == len(subjects) == 1:
        file.checked_for(rigs[0])
    if yes:
        return
    if not sys.stdin.isatty():
        raise UsageError("--rig-file prompts before anything moves, and stdin is no terminal.",
                         hint="Add --yes if all is clear.")  # fmt: skip
    click.confirm(
        f"The lines of the devices and sensors that are checked are opened; the rig, where it is checked, presses a "
        f"sensor twice to {REAL_N:g} N. Is the rig clear?", abort=True, err=True,
    )  # fmt: skip


def _keep(out: Path, checked: Subject, report: CheckReport) -> None:
    """Write the level of a sensor into a result folder, with what tells which state of its package was checked."""
    import tactbench
    from tactbench.core.leaderboard.levels import identity_of, write_level
    from tactbench.core.matrix.store import writing
    from tactbench.core.provenance.gather import gather

    with writing(out):
        path = write_level(
            out, checked.name,
            {
                "level": report.level or "none", "failed": len(report.failed),
                "modes": list(report.modes), "kit": tactbench.__version__, "package": checked.package,
                "identity": identity_of(checked.package, gather(checked.registry)),
            },
        )  # fmt: skip
    remark(f"Level of {checked.name}: {path}")


def _plain(report: CheckReport) -> dict[str, object]:
    import tactbench

    return {
        "kind": report.kind, "name": report.name, "ok": report.ok, "level": report.level,
        "kit": tactbench.__version__, "modes": list(report.modes), "checks": [one._asdict() for one in report.outcomes],
    }  # fmt: skip


def _lines(report: CheckReport) -> Iterator[tuple[str, str]]:
    """Yield what did not pass; checks that were skipped for one reason together."""
    for one in report.failed:
        yield "FAILED", f"{one.check}: {one.where}: {one.text}"
        if one.advice:
            yield "  do", one.advice
    reasons: dict[str, list[str]] = {}
    for one in report.of("skipped"):
        reasons.setdefault(one.text, []).append(one.check)
    for text, names in reasons.items():
        yield "skipped", f"{f'{len(names)} checks' if len(names) > 1 else names[0]}: {text}"
