"""``tactbench emulate``: emulated sensors and devices on links of this machine, moved by a simulated rig."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig_file import RigFile

HEAD = "# Written by `tactbench emulate`; these links exist only until that command ends."


@click.command(name="emulate", short_help="Start emulated devices on links of this machine.")
@click.argument("names", nargs=-1, metavar="[DEVICE]...")
@click.option("--rig-file", type=click.Path(path_type=Path), metavar="FILE",
              help="Start every device with `link: emulated` in this rig file, with its faults.")  # fmt: skip
def command(names: tuple[str, ...], rig_file: Path | None) -> None:
    """Start emulated sensors and devices on links of this machine; they run until Ctrl-C.

    DEVICE is a sensor or device by name, for example: tactbench emulate biotac net-ft. The rig file that
    opens them is printed: > rig.yaml. They are at rest until a recording with that file begins; then a
    simulated rig carries out its scene.
    """
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.plugins.rigs import load_rig_file
    from tactbench.devices.scene_emulators import serve

    if bool(names) == (rig_file is not None):
        raise UsageError(
            "Give either names of devices or a rig file.",
            hint="For example: tactbench emulate biotac net-ft; `tactbench list devices` lists all devices.",
        )
    registry = load_registry()
    file = load_rig_file(rig_file, registry) if rig_file is not None else _named(registry, names)
    if not file.emulated:
        raise UsageError("The rig file has no emulated device.", hint="Write `link: emulated` for at least one device.")
    serve(file, registry, started=_print_file, progress=remark)


def _named(registry: Registry, names: Sequence[str]) -> RigFile:
    """Return a rig file for the bench with all sensors and devices in `names`, each emulated."""
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.spec.rig_file import EMULATED, FORCE, RigFile

    plain: dict[str, Any] = {"rig": "bench", "sensors": {}, "devices": {}}
    for name in names:
        if name in registry.sensors:
            plain["sensors"][name] = {"link": EMULATED}
        elif name in registry.devices:
            kind = registry.devices[name].kind
            part = plain if kind == FORCE else plain["devices"]
            if kind in part:
                raise UsageError(f"A rig has one {kind} device; {name} is a second one.", hint="Give only one.")
            part[kind] = {"link": EMULATED, "device": name}
        else:
            raise UnknownNameError("sensor or device", name, [*registry.sensors.names(), *registry.devices.names()])
    if not plain["sensors"]:
        known = ", ".join(registry.sensors.names())
        raise UsageError("A rig needs a sensor, and no sensor was given.", hint=f"Add one of these sensors: {known}.")
    return RigFile.model_validate(plain)


def _print_file(live: RigFile) -> None:
    """Print the rig file that opens the devices, and the command that records with it."""
    import yaml

    file = live
    if file.rig == "bench" and file.devices:
        for name, entry in file.devices.items():
            remark(f"The rig `bench` does not open the {name}, which is at {entry.link}")
        file = file.model_copy(update={"devices": {}})
    plain = file.model_dump(mode="json", exclude_defaults=True, exclude={"version"})
    click.echo(f"{HEAD}\n{yaml.safe_dump({'version': 1, **plain}, sort_keys=False)}", nl=False)
    remark("Ctrl-C ends the emulated devices. Save the text above as rig.yaml, then record in another terminal:")
    remark(f"  tactbench record --rig-file rig.yaml --sensor {next(iter(file.sensors))} --live --out press.h5")
