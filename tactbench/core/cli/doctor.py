"""``tactbench doctor``: what this machine has for devices, and whether those of a rig answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import FiniteRange
from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.cli.device_check import DeviceCheck, DeviceClock, StreamCheck
    from tactbench.core.cli.host_devices import DeviceFile, Host
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig_file import RigFile
    from tactbench.devices.emulator import Senses

Rows = list[tuple[str, ...]]


@click.command(name="doctor")
@click.option("--rig-file", type=click.Path(path_type=Path), metavar="FILE",
              help="Also open the devices of this rig, and read them while nothing touches them.")  # fmt: skip
@click.option("--sensor", metavar="NAME", help="Of the rig's sensors, this one alone.")
@click.option("--seconds", type=FiniteRange(min=0.1, max=600), default=3.0, show_default=True, metavar="T",
              help="How long each device is read.")  # fmt: skip
@click.option("--format", "shape", type=click.Choice(("table", "json")), default="table", show_default=True)
@click.pass_context
def command(ctx: click.Context, rig_file: Path | None, sensor: str | None, seconds: float, shape: str) -> None:
    """Show ports, permissions, buses, extras, drivers and the clock; with --rig-file whether its devices answer.

    Nothing is opened without --rig-file; motors are never started. Exit code 1 if something is wrong, 2 for a wrong
    rig file.
    """
    import time
    from dataclasses import asdict

    from tactbench.core.cli.device_check import as_plain, check_devices
    from tactbench.core.cli.host_devices import look_at_host
    from tactbench.core.cli.screen import remark
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.plugins.rig_files import load_rig_file

    if sensor is not None and rig_file is None:
        raise UsageError("--sensor picks one of a rig's sensors.", hint="Give the rig with --rig-file FILE.")
    registry = load_registry()
    rig = None if rig_file is None else load_rig_file(rig_file, registry)
    sensors = _sensors(rig, sensor, registry)
    host = look_at_host()
    checks: list[DeviceCheck] = []
    if rig is not None:
        remark(f"Reading each device for {seconds:g} s; nothing may touch them.")
        senses = _at_rest(rig, sensors, registry) if rig.emulated else None
        checks = check_devices(rig, registry, sensors, seconds=seconds, clock=time.monotonic_ns, senses=senses)
    problems = [*host.problems, *(f"{check.name}: {text}" for check in checks for text in check.problems)]
    if shape == "json":
        about = {
            "host": asdict(host),
            "drivers": [
                dict(zip(("name", "kind", "driver", "emulator"), row, strict=True)) for row in _drivers(registry)
            ],
            "devices": as_plain(checks),
            "problems": problems,
        }
        click.echo(json_text(about, indent=1))
    else:
        _print(host, registry, rig, checks, problems)
    ctx.exit(1 if problems else 0)


def _sensors(rig: RigFile | None, sensor: str | None, registry: Registry) -> tuple[str, ...]:
    """Return the sensors to look at; raises UnknownNameError for one that the file or the registry does not have."""
    from tactbench.core.errors import UnknownNameError

    if rig is None:
        return ()
    if sensor is not None and sensor not in rig.sensors:
        raise UnknownNameError("sensor in this rig file", sensor, rig.sensors)
    names = tuple(rig.sensors) if sensor is None else (sensor,)
    for name in names:
        registry.sensors[name]
    for name, entry in rig.entries().items():
        if name not in rig.sensors:
            registry.devices[str(getattr(entry, "device", name))]
    return names


def _at_rest(rig: RigFile, sensors: Sequence[str], registry: Registry) -> Callable[[str], Senses]:
    """Return by name what the rig's emulated devices sense at rest: a scene that never begins."""
    from tactbench.core.cli.emulate import Presser
    from tactbench.core.cli.scenes import scene_of

    pressed = [name for name in sensors if rig.sensors[name].emulated]
    scenes = {name: scene_of("rest", None, None, None, registry.sensors[name]) for name in pressed}
    how = rig.emulation
    presser = Presser(registry, how.physics, scenes, scene_of("rest", None, None, None, None), how.seed)
    presser.draw(1)
    return presser.senses


def _drivers(registry: Registry) -> Rows:
    """Return name, kind, driver and emulator of what can be connected."""
    rows = [(one.name, "sensor", one.driver, one.emulator) for one in registry.sensors if one.driver or one.emulator]
    rows += [(one.name, one.kind, one.driver, one.emulator) for one in registry.devices]
    return [(name, kind, driver or "", emulator or "") for name, kind, driver, emulator in rows]


def _print(
    host: Host, registry: Registry, rig: RigFile | None, checks: Sequence[DeviceCheck], problems: Sequence[str]
) -> None:
    from tactbench.core.cli.screen import print_table

    ports = [_port(one) for one in host.serial]
    print_table("serial ports", ("port", "what", "usb", "may open", "name that stays"), ports)
    print_table("buses, network, clock", ("", "here", "next step"), list(_machine(host)))
    extras = [
        (one.name, ", ".join(one.requires), *(("missing", one.command) if one.missing else ("installed", "")))
        for one in host.extras
    ]
    print_table("extras", ("extra", "requires", "state", "install it with"), extras, whole="install it with")
    drivers = [
        (name, kind, "yes" if driver else "no", "yes" if made else "no")
        for name, kind, driver, made in _drivers(registry)
    ]
    print_table("devices that can be connected", ("name", "kind", "driver", "emulator"), drivers)
    if rig is not None:
        _print_rig(checks)
    for text in problems:
        click.secho("Wrong: ", fg="red", bold=True, nl=False)
        click.echo(text)
    if not problems:
        click.echo("Nothing is wrong." if rig else "Nothing is wrong. To try the devices themselves: --rig-file FILE")


def _port(port: DeviceFile) -> tuple[str, ...]:
    allowed = "yes" if port.allowed else f"no ({port.group or 'not its owner'})"
    return port.path, port.title, port.usb, allowed, ", ".join(port.names)


def _machine(host: Host) -> Iterator[tuple[str, ...]]:
    """Yield a line for each thing: its name, what is here, and the next step if there is one."""
    network, clock = host.network, host.clock
    yield "socketcan", "AF_CAN is there" if network.socketcan else "the kernel has no AF_CAN", ""
    for interface in host.can:
        yield f"CAN {interface.name}", "up" if interface.up else "down", interface.hint
    if not host.can:
        yield "CAN", "no interface", "an adapter with Lawicel's commands needs none: see slcan"
    usb = [port for port in host.serial if port.usb]
    candidates = ", ".join(f"can://slcan/{port.address}?bitrate=1000000" for port in usb)
    yield "slcan", candidates or "no serial port on USB", "if it is such an adapter" if usb else ""
    for device in host.spi:
        yield "SPI", device.path, "" if device.allowed else device.hint
    if not host.spi:
        yield "SPI", "no /dev/spidev*", "a bridge on a serial port needs none: docs/links.md"
    route = f"goes out from {network.multicast_from}" if network.multicast_from else "no route"
    yield "multicast", route, ""
    if network.largest_buffer_bytes is not None:
        yield "datagrams", f"buffer of at most {network.largest_buffer_bytes} bytes", ""
    for hint in network.hints:
        yield "", "", hint
    late = f"late by {clock.late_median_us / 1e3:.2f} ms (median of {clock.sleeps})"
    yield "sleep of 5 ms", f"{late}, {clock.late_largest_us / 1e3:.2f} ms at most", ""
    yield "clock", f"steps of {clock.step_ns} ns", ""
    steered = "" if clock.steered_ppm is None else f"; NTP steers by {clock.steered_ppm:+.2f} ppm now"
    yield "wall clock", f"{clock.wall_us:+.1f} us against it in half a second{steered}", ""


def _print_rig(checks: Sequence[DeviceCheck]) -> None:
    from tactbench.core.cli.screen import print_table

    lines = [
        (check.name, check.device, check.link, _identity(check), "; ".join([*check.remarks, *_counts(check)]))
        for check in checks
    ]
    print_table("the rig's devices", ("name", "device", "link", "says", "remarks"), lines)
    streams = [(check.name, *_stream(stream)) for check in checks for stream in check.streams]
    if streams:
        print_table("streams", ("device", "stream", "rows", "Hz", "stated", "lost or marked"), streams)
    clocks = [
        (check.name, stream.stream, *_clock(stream.clock))
        for check in checks
        for stream in check.streams
        if stream.clock
    ]
    if clocks:
        print_table("clocks of devices", ("device", "stream", "host - device", "drift", "error at most"), clocks)
    noise = [row for check in checks for stream in check.streams for row in _noise(check, stream)]
    if noise:
        print_table("unloaded", ("device", "channels", "mean", "sd (median)", "sd (largest)", "constant"), noise)


def _identity(check: DeviceCheck) -> str:
    if check.identity:
        return ", ".join(f"{name} {value}" for name, value in check.identity.items())
    return "-" if check.problems or check.emulated else "nothing"


def _counts(check: DeviceCheck) -> list[str]:
    return [f"{number} {name}" for name, number in check.counts.items()]


def _stream(stream: StreamCheck) -> tuple[str, ...]:
    rates = ("-" if rate is None else f"{rate:.5g}" for rate in (stream.rate_hz, stream.nominal_hz))
    counts = {"lost": stream.lost, "twice or late": stream.unordered, **stream.marks}
    marked = ", ".join(f"{number} {name}" for name, number in counts.items() if number)
    return stream.stream, str(stream.rows), *rates, marked or "none"


def _clock(clock: DeviceClock) -> tuple[str, str, str]:
    bound = "not known: too few samples" if clock.bound_us is None else f"{clock.bound_us:.3g} us"
    broken = f"; went back {clock.breaks} times" if clock.breaks else ""
    return f"{clock.offset_s:+.6f} s", f"{clock.drift_ppm:+.3g} ppm", bound + broken


def _noise(check: DeviceCheck, stream: StreamCheck) -> Iterator[tuple[str, ...]]:
    for one in stream.noise:
        means = list(one.means.values())
        mean = "-"
        if one.kind in ("force", "torque"):
            mean = ", ".join(f"{name} {value:+.4g}" for name, value in one.means.items())
        elif means:
            mean = f"{min(means):.5g} … {max(means):.5g}" if len(means) > 1 else f"{means[0]:.5g}"
        sd = "-" if one.sd_median is None else f"{one.sd_median:.3g} {one.unit}"
        largest = "-" if one.sd_largest is None else f"{one.sd_largest:.3g} ({one.noisiest})"
        constant = ", ".join(one.constant) if len(one.constant) <= 4 else f"{len(one.constant)} channels"
        channels = next(iter(one.means)) if len(one.means) == one.channels == 1 else f"{one.channels} {one.kind}"
        yield check.name, channels, mean, sd, largest, constant
