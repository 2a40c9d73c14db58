"""``tactbench check``: whether a plugin keeps what plugins promise."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import FiniteRange
from tactbench.core.cli.threads import keep_threads
from tactbench.core.spec.bounds import MOST_SECONDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tactbench.core.conformance.run import CheckReport
    from tactbench.core.conformance.subject import Subject
    from tactbench.core.spec.rig_file import RigFile

_KINDS = ("sensor", "rig", "device", "task", "estimator", "effect", "indenter", "profile")


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
@click.option("--timeout", type=FiniteRange(min=1, max=MOST_SECONDS), default=30.0, show_default=True, metavar="S",
              help="Seconds that one check may take.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path, exists=True, file_okay=False), metavar="FOLDER",
              help="Keep the level in this result folder: its tables show it beside the sensor.")  # fmt: skip
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
    out: Path | None,
    shape: str,
) -> None:
    """Check a sensor, rig, device, task, estimator, effect, indenter or profile, or all that a plugin brings.

    By default nothing is opened and nothing moves; docs/conformance.md lists the checks. Exit code 1 if a check failed
    or fewer ran than every plugin of that kind can run, 2 if nothing is called NAME.
    """
    keep_threads()
    from tactbench.core.cli.operator import TerminalOperator
    from tactbench.core.cli.results import opened
    from tactbench.core.cli.screen import remark
    from tactbench.core.conformance.check import KINDS, Mode
    from tactbench.core.conformance.run import failed_plugins, plugins_named, run_checks, subjects_named
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.plugins.rig_files import load_rig_file
    from tactbench.core.tables.text import json_text

    if (rig_file is not None) != invasive:
        raise UsageError(
            "--invasive and --rig-file FILE go together: the file says which devices are opened.",
            hint="Give both, or neither.",
        )
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
    if out is not None and ("passive" not in modes or not any(one.kind == "sensor" for one in subjects)):
        raise UsageError(
            "--out keeps the level of a sensor, and none is computed here.",
            hint="Name a sensor, and add --passive beside --recording.",
        )
    if out is not None:
        opened(out)
    if rig_file is not None:
        _ask(subjects, load_rig_file(rig_file, registry), yes)
    reports = [
        run_checks(
            one,
            modes=modes,
            recording=recording,
            rig_file=rig_file,
            operator=TerminalOperator(yes=yes),
            timeout_s=timeout,
        )
        for one in subjects
    ]
    if out is not None:
        for checked, report in zip(subjects, reports, strict=True):
            if checked.kind == "sensor":
                _keep(out, checked, report)
    if shape == "json":
        click.echo(json_text({"failed_plugins": wrong, "checked": [_plain(one) for one in reports]}, indent=1))
    else:
        for text in wrong:
            click.secho("could not be loaded  ", fg="red", nl=False)
            click.echo(text)
        for report in reports:
            _print(report, every)
    ctx.exit(1 if wrong or not all(one.ok for one in reports) or not reports else 0)


def _ask(subjects: Sequence[Subject], file: RigFile, yes: bool) -> None:
    """Say what is about to be opened and moved, and wait for a yes.

    Raises
    ------
    UsageError
        If nobody is there to say it, or the file is for another rig than the only one that is checked.
    """
    from tactbench.core.conformance.invasive import FORCE_N
    from tactbench.core.errors import UsageError

    rigs = [one.name for one in subjects if one.kind == "rig"]
    if len(rigs) == len(subjects) == 1:
        file.checked_for(rigs[0])
    if yes:
        return
    if not sys.stdin.isatty():
        raise UsageError(
            "--invasive asks before anything moves, and nobody is there.", hint="Add --yes if all is clear."
        )
    known = {*file.sensors, *(getattr(one, "device", None) for one in file.entries().values())}
    lines = [one.name for one in subjects if one.kind in ("sensor", "device") and one.name in known]
    what = [f"opens the line of {name}" for name in lines]
    if file.rig in rigs:
        what.append(f"presses {next(iter(file.sensors))} twice to {FORCE_N:g} N with the rig {file.rig}")
    click.confirm(f"This {' and '.join(what) or 'opens nothing'}. Is the rig clear?", abort=True, err=True)


def _keep(out: Path, checked: Subject, report: CheckReport) -> None:
    """Write the level of a sensor into a result folder, with what tells which state of its package was checked."""
    import tactbench
    from tactbench.core.cli.screen import remark
    from tactbench.core.leaderboard.levels import identity_of, write_level
    from tactbench.core.matrix.store import writing
    from tactbench.core.provenance.gather import gather

    with writing(out):
        path = write_level(
            out, checked.name,
            {
                "level": report.level or "none", "ran": report.ran, "failed": len(report.failed),
                "modes": list(report.modes), "kit": tactbench.__version__, "package": checked.package,
                "identity": identity_of(checked.package, gather(checked.registry)),
            },
        )  # fmt: skip
    remark(f"Level of {checked.name}: {path}")


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
