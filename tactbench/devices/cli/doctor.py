"""``tactbench doctor``: check of this machine's ports and buses, and of a rig's devices."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.shared import FiniteRange, format_option
from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.plugins.interfaces import RigCheck
    from tactbench.devices.cli.device_check import DeviceCheck, HostItem


@click.command(name="doctor", short_help="List ports, buses and permissions, and check a rig's devices.")
@click.option("--rig-file", type=click.Path(path_type=Path), metavar="FILE",
              help="Also check the forces which this rig file permits, then open and read its devices.")  # fmt: skip
@click.option("--seconds", type=FiniteRange(min=0, max=600), default=3.0, show_default=True, metavar="T",
              help="Time [s] to read each device; 0 opens no device.")  # fmt: skip
@click.option("--jog", metavar="AXIS",
              help="Move one axis of the rig by small steps; the force is monitored and shown.")  # fmt: skip
@format_option("table", "json")
@click.pass_context
def command(ctx: click.Context, rig_file: Path | None, seconds: float, jog: str | None, shape: str) -> None:
    """List ports and buses of this machine, with permissions, and check the devices of a rig.

    Nothing is opened without --rig-file, or if the rig refuses the file; only --jog starts a motor. Problems are
    printed first. Exit code 1 if the rig refuses the file or a device has a problem, or, without a rig file, if a port
    may not be opened; 2 for a wrong rig file.
    """
    import time
    from dataclasses import asdict

    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.plugins.rigs import load_rig_file
    from tactbench.core.tables.terminal import remark
    from tactbench.devices.cli.device_check import check_devices, look_at_host
    from tactbench.devices.rig_devices import descriptor_of

    registry = load_registry()
    rig = None if rig_file is None else load_rig_file(rig_file, registry)
    host = list(look_at_host())
    would: RigCheck | None = None
    checks: list[DeviceCheck] = []
    if rig is not None:
        where = registry.rigs[rig.rig].check
        would = load_object(where)(rig) if where else None
        for name, entry in rig.entries().items():
            descriptor_of(registry, name, entry)  # an unknown name is an error of the file, not a problem of a device
        if jog is None and seconds and not (would and would.problems):
            remark(f"Reading each device for {seconds:g} s; nothing may touch them.")
            checks = check_devices(rig, registry, seconds=seconds, clock=time.monotonic_ns)
    denied = [f"{one.name}: permission denied. {one.denied}" for one in host if one.denied]
    of_rig = [f"refused: {text}" for text in (would.problems if would else ())]
    of_rig += [f"{check.name}: {text}" for check in checks for text in check.problems]
    if shape == "json":
        of_file = {"tables": list(map(asdict, would.tables)), "problems": would.problems} if would else None
        about = {"host": list(map(asdict, host)), "rig": of_file,
                 "devices": list(map(asdict, checks)), "problems": of_rig + denied}  # fmt: skip
        click.echo(json_text(about, indent=1))
    else:
        _print(host, would, checks, of_rig + denied)
        if rig is not None and not checks and jog is None:
            click.echo("No device was opened, and no axis has moved.")
    if jog is not None and not of_rig:
        from tactbench.devices.cli.jog import jog_axis

        jog_axis(rig, would, registry, jog)
    ctx.exit(1 if of_rig or (denied and rig is None) else 0)


def _print(
    host: Sequence[HostItem], would: RigCheck | None, checks: Sequence[DeviceCheck], problems: Sequence[str]
) -> None:
    from tactbench.core.cli.shared import print_fields, print_records, print_tables
    from tactbench.core.tables.text import text_table

    print_fields([("WRONG", text) for text in problems])
    print_tables([text_table(one.title, one.head, one.rows) for one in (would.tables if would else ())])
    print_records([one for check in checks for one in check.streams], "table", title="untouched")
    fields = []
    for check in checks:
        facts = [*check.remarks, *(f"{name} {value}" for name, value in {**check.identity, **check.counts}.items())]
        fields.append((check.name, f"{check.device}, {check.link}: {', '.join(facts)}"))
    fields += [(one.kind, f"{one.name} {one.text}") for one in host]
    print_fields(fields or [("ports", "this machine has no serial port, SPI device or CAN interface")])
