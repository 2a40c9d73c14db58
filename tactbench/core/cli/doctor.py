"""``tactbench doctor``: what this machine has for devices, and whether those of a rig answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import FiniteRange, format_option
from tactbench.core.tables.text import json_text, visible

if TYPE_CHECKING:
    from tactbench.core.cli.device_check import DeviceCheck, StreamCheck
    from tactbench.core.cli.host_devices import HostItem
    from tactbench.core.plugins.checks import RigCheck
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig_file import RigFile
    from tactbench.devices.emulator import Senses

_STREAMS = ("device", "stream", "rows", "Hz", "stated", "lost or marked", "mean", "noise sd", "its clock")


@click.command(name="doctor")
@click.option("--rig-file", type=click.Path(path_type=Path), metavar="FILE",
              help="Also check what the rig would do by this file, then open and read its devices.")  # fmt: skip
@click.option("--seconds", type=FiniteRange(min=0, max=600), default=3.0, show_default=True, metavar="T",
              help="Time to read each device; 0 opens nothing.")  # fmt: skip
@format_option("table", "json")
@click.pass_context
def command(ctx: click.Context, rig_file: Path | None, seconds: float, shape: str) -> None:
    """Check ports, permissions, buses, extras and the clock, and the devices of a rig.

    Nothing is opened without --rig-file, or if the rig refuses the file; motors are never started. What does not work
    comes first. Exit code 1 if the rig refuses the file or a device has a problem, without a rig if a port may not be
    opened; 2 for a wrong rig file.
    """
    import time
    from dataclasses import asdict

    from tactbench.core.cli.device_check import check_devices
    from tactbench.core.cli.host_devices import look_at_host
    from tactbench.core.cli.screen import remark
    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.plugins.rig_files import load_rig_file

    registry = load_registry()
    rig = None if rig_file is None else load_rig_file(rig_file, registry)
    host = look_at_host()
    would: RigCheck | None = None
    checks: list[DeviceCheck] = []
    if rig is not None:
        where = registry.rigs[rig.rig].check
        would = load_object(where)(rig) if where else None
        _check_names(rig, registry)
        if seconds and not (would and would.problems):
            remark(f"Reading each device for {seconds:g} s; nothing may touch them.")
            senses = _at_rest(rig, registry) if rig.emulated else None
            checks = check_devices(rig, registry, seconds=seconds, clock=time.monotonic_ns, senses=senses)
    denied = [f"{one.name}: permission denied. {one.hint}" for one in host if one.state == "denied"]
    of_rig = [f"refused: {text}" for text in (would.problems if would else ())]
    of_rig += [f"{check.name}: {text}" for check in checks for text in check.problems]
    problems = [*of_rig, *denied]
    if shape == "json":
        about = {"host": list(map(asdict, host)), "drivers": list(_drivers(registry)),
                 "rig": asdict(would) if would else None, "devices": list(map(asdict, checks)),
                 "problems": problems}  # fmt: skip
        click.echo(json_text(about, indent=1))
    else:
        _print(host, registry, would, checks, problems)
        if rig is not None and not checks:
            click.echo("Nothing was opened, and nothing has moved.")
    ctx.exit(1 if of_rig or (denied and rig is None) else 0)


def _check_names(rig: RigFile, registry: Registry) -> None:
    """Raise UnknownNameError for a sensor or device that is not installed."""
    for name, entry in rig.entries().items():
        if name in rig.sensors:
            registry.sensors[name]
        else:
            registry.devices[str(getattr(entry, "device", name))]


def _at_rest(rig: RigFile, registry: Registry) -> Callable[[str], Senses]:
    """Return by name what the rig's emulated devices sense at rest: a scene that never begins, of a sensor its own."""
    from tactbench.core.cli.scenes import scene_of
    from tactbench.core.plugins.rig_devices import physics_of
    from tactbench.devices.emulation.scene_samples import SceneSamples

    physics = physics_of(rig, registry)
    found: dict[str, Senses] = {}
    for name, entry in rig.sensors.items():
        if physics is not None and entry.emulated:
            scene = scene_of("rest", registry.sensors[name])
            with physics.open(registry.sensors[name], scene, seed=rig.emulation.seed) as simulated:
                found[name] = SceneSamples(simulated, scene.profile.duration.to("s"), rest_s=scene.profile.hold_s)
    other: Senses = next(iter(found.values()), lambda t_s: {})
    return lambda name: found.get(name, other)


def _drivers(registry: Registry) -> Iterator[dict[str, str]]:
    """Yield what can be connected."""
    kinds = [(one, "sensor") for one in registry.sensors] + [(one, one.kind) for one in registry.devices]
    for one, kind in kinds:
        if one.driver or one.emulator:
            yield {"name": one.name, "kind": kind, "driver": one.driver or "", "emulator": one.emulator or ""}


def _print(
    host: Sequence[HostItem], registry: Registry, would: RigCheck | None, checks: Sequence[DeviceCheck],
    problems: Sequence[str],
) -> None:  # fmt: skip
    from tactbench.core.cli.grid import print_tables
    from tactbench.core.tables.text_table import TextTable

    for text in problems:
        click.secho("Wrong: ", fg="red", bold=True, nl=False)
        click.echo(visible(text))
    for one in host:
        if one.state == "missing":
            click.secho("Missing: ", fg="yellow", nl=False)
            name = f"extra {one.name}" if one.kind == "extra" else one.name
            click.echo(visible(f"{name}: {'. '.join(filter(None, (one.text, one.hint)))}"))
    tables = [(table.title, table.head, table.rows) for table in (would.tables if would else ())]
    streams = [row for check in checks for stream in check.streams for row in _stream(check, stream)]
    print_tables([TextTable(title, tuple(head), tuple(map(tuple, rows)))
                  for title, head, rows in (*tables, ("untouched", _STREAMS, streams)) if rows])  # fmt: skip
    for check in checks:
        said = ", ".join(f"{name} {value}" for name, value in check.identity.items())
        remarks = [*check.remarks, *(f"{number} {name}" for name, number in check.counts.items())]
        state = "wrong" if check.problems else "answers" if said or check.streams else "not asked"
        text = f"{check.name} ({check.device}, {check.link}): {'; '.join(filter(None, (state, said, *remarks)))}"
        click.echo(visible(text))
    works = [f"{one.name} ({one.text})" if one.text else one.name for one in host if one.state == "works"]
    names = ", ".join(one["name"] for one in _drivers(registry))
    click.echo(visible(f"Works: {', '.join(works)}. Drivers or emulators of {names}."))


def _stream(check: DeviceCheck, stream: StreamCheck) -> Iterator[tuple[str, ...]]:
    """Yield a line for each kind of channel of a stream."""
    rates = ("-" if rate is None else f"{rate:.5g}" for rate in (stream.rate_hz, stream.nominal_hz))
    counts = {"lost": stream.lost, "twice or late": stream.unordered, **stream.marks}
    marked = ", ".join(f"{number} {name}" for name, number in counts.items() if number)
    clock = "-"
    if stream.clock is not None:
        bound = "error not known" if stream.clock.bound_us is None else f"within {stream.clock.bound_us:.3g} us"
        clock = f"{stream.clock.drift_ppm:+.3g} ppm, {bound}"
    first = (check.name, stream.stream, str(stream.rows), *rates, marked or "none")
    for one in stream.noise:
        means = [f"{name} {value:+.4g}" for name, value in one.means.items()]
        if one.kind not in ("force", "torque") and len(means) > 1:
            means = [f"{min(one.means.values()):.5g} … {max(one.means.values()):.5g}"]
        constant = f"; {len(one.constant)} constant" if one.constant else ""
        largest = "" if one.sd_largest is None or one.channels == 1 else f", {one.sd_largest:.3g} ({one.noisiest})"
        noise = "-" if one.sd_median is None else f"{one.sd_median:.3g} {one.unit}{largest}{constant}"
        yield (*first, ", ".join(means), noise, clock)
        first = ("",) * len(first)
