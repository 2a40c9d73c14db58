"""``tactbench check``: whether a plugin keeps what plugins promise."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.threads import one_thread

if TYPE_CHECKING:
    from tactbench.core.conformance.run import CheckReport

_KINDS = ("sensor", "rig", "task", "estimator", "effect", "indenter", "profile")


@click.command(name="check")
@click.argument("name")
@click.option("--kind", type=click.Choice(_KINDS), help="Of several things of that name, this one alone.")
@click.option("--recording", type=click.Path(path_type=Path, exists=True, dir_okay=False), metavar="FILE",
              help="Read this recording of the sensor, and nothing else.")  # fmt: skip
@click.option("--passive", is_flag=True, help="Run the checks that open nothing also beside --recording.")
@click.option("--invasive", is_flag=True, help="Also open the device's line, or press with the rig.")
@click.option("--rig-file", type=click.Path(path_type=Path, exists=True, dir_okay=False), metavar="FILE",
              help="Which devices stand on which lines, for --invasive.")  # fmt: skip
@click.option("--yes", is_flag=True, help="Do not ask before something is opened or moves.")
@click.option("--all", "every", is_flag=True, help="Also list the checks that passed.")
@click.option("--timeout", type=click.FloatRange(min=1), default=30.0, show_default=True, metavar="S",
              help="Seconds that one check may take.")  # fmt: skip
@click.option("--format", "shape", type=click.Choice(("table", "json")), default="table", show_default=True)
@click.pass_context
def command(
    ctx: click.Context,
    name: str,
    kind: str | None,
    recording: Path | None,
    passive: bool,
    invasive: bool,
    rig_file: Path | None,
    yes: bool,
    every: bool,
    timeout: float,
    shape: str,
) -> None:
    """Check a sensor, rig, task, estimator, effect, indenter or profile, or all that a plugin brings.

    By default nothing is opened and nothing moves; docs/conformance.md lists the checks. Exit code 1 if a check failed
    or fewer ran than every plugin of that kind can run, 2 if nothing is called NAME.
    """
    one_thread()
    from tactbench.core.cli.screen import remark
    from tactbench.core.conformance.check import KINDS, Mode
    from tactbench.core.conformance.run import failed_plugins, plugins_named, run_checks, subjects_named
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.tables.text import json_text

    if rig_file is not None and not invasive:
        raise UsageError("--rig-file is for --invasive.", hint="Add it, or leave the file out.")
    registry = load_registry()
    kinds = tuple(one for one in KINDS if kind in (None, one))
    wrong = [f"{row.entry_point}: {row.reason}" for row in plugins_named(registry, name) if row.status == "failed"]
    try:
        subjects = subjects_named(registry, name, kinds)
    except UnknownNameError as error:
        wrong = list(failed_plugins(registry))
        if not wrong:
            raise
        subjects = []
        remark(error.message)
    modes: tuple[Mode, ...] = ("passive",) if passive or recording is None else ()
    modes += ("invasive",) if invasive else ()
    modes += ("recording",) if recording is not None else ()
    if recording is not None:
        subjects = [one for one in subjects if one.kind == "sensor"]
        if not subjects and not wrong:
            raise UsageError(f"{name} is no sensor, and a recording is of one.", hint="Leave --recording out.")
    if invasive and not yes and not sys.stdin.isatty():
        raise UsageError(
            "--invasive asks before anything moves, and nobody is there.", hint="Add --yes if all is clear."
        )
    if invasive and not yes:
        what = ", ".join(f"the {one.kind} {one.name}" for one in subjects)
        click.confirm(
            f"This opens lines of {what} and may move or press something. Is the rig clear?", abort=True, err=True
        )
    reports = [
        run_checks(one, modes=modes, recording=recording, rig_file=rig_file, timeout_s=timeout) for one in subjects
    ]
    if shape == "json":
        click.echo(json_text({"failed_plugins": wrong, "checked": [_plain(one) for one in reports]}, indent=1))
    else:
        for text in wrong:
            click.secho("could not be loaded  ", fg="red", nl=False)
            click.echo(text)
        for report in reports:
            _print(report, every)
    ctx.exit(1 if wrong or not all(one.ok for one in reports) or not reports else 0)


def _plain(report: CheckReport) -> dict[str, object]:
    import tactbench

    return {
        "kind": report.kind, "name": report.name, "ok": report.ok, "level": report.level, "ran": report.ran,
        "kit": tactbench.__version__, "modes": list(report.modes), "checks": [one._asdict() for one in report.outcomes],
    }  # fmt: skip


def _print(report: CheckReport, every: bool) -> None:
    from tactbench.core.conformance.kit import checks_of
    from tactbench.core.tables.text import visible_lines

    cures = {one.name: one for one in checks_of(report.kind, *report.modes)}
    if every:
        for one in report.passed:
            click.secho("passed   ", fg="green", nl=False)
            click.echo(one.check)
    reasons: dict[str, list[str]] = {}
    for one in report.skipped:
        reasons.setdefault(one.text, []).append(one.check)
    for text, names in reasons.items():
        click.secho("skipped  ", fg="yellow", nl=False)
        click.echo(visible_lines(f"{len(names)} checks: {text}" if len(names) > 1 else f"{names[0]}: {text}"))
        if every and len(names) > 1:
            click.echo(f"         {', '.join(names)}")
    for one in report.expected:
        click.secho("expected ", fg="yellow", nl=False)
        click.echo(visible_lines(f"{one.check}: {one.text}"))
    for one in report.failed:
        click.secho("FAILED   ", fg="red", bold=True, nl=False)
        click.echo(visible_lines(f"{one.check}: {one.where}: {one.text}"))
        if one.check in cures:
            click.echo(f"         why: {cures[one.check].why}\n         do:  {cures[one.check].cure}")
    click.secho(report.summary, bold=True)
