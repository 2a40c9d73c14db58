"""The rig with a linear motor on a parallel manipulator and a force-torque sensor, and their drivers and emulators.

No part of it was tested on a real device: each codec is tested against public descriptions, each driver against its
emulator.
"""

from __future__ import annotations

from tactbench.plugin import RigDescriptor, hookimpl
from tactbench.plugin.devices import DeviceDescriptor

TACTBENCH_API = 2


@hookimpl
def tactbench_devices() -> list[DeviceDescriptor]:
    """Register the devices with the plugin manager."""
    here = __name__
    return [
        DeviceDescriptor(
            name="net-ft",
            title="ATI force-torque sensor behind a Net F/T box, by UDP",
            kind="force",
            driver=f"{here}.net_ft.driver:NetFtDriver",
            emulator=f"{here}.net_ft.emulator:RdtEmulator",
            emulated_link="datagram",
            # Usual counts (sourced: netft/pyNetFT).
            emulated_options={"counts_per_newton": 1e6, "counts_per_newton_metre": 1e6},
        ),
        DeviceDescriptor(
            name="faulhaber",
            title="linear motor on a Faulhaber drive, ASCII by RS232",
            kind="motor",
            driver=f"{here}.motor.driver:FaulhaberDriver",
            emulator=f"{here}.motor.emulator:MotorEmulator",
            emulated_link="bytes",
        ),
    ]


@hookimpl
def tactbench_rigs() -> list[RigDescriptor]:
    """Register the rig with the plugin manager."""
    here = __name__
    return [
        RigDescriptor(
            name="parallel-manipulator",
            title="a linear motor on a delta manipulator presses under force control, guarded",
            where=f"{here}.rig:build",
            references={"force": (), "torque": (), "position": ("position",)},
            file=f"{here}.settings:ManipulatorFile",
            check=f"{here}.rig_check:check",
            emulators=f"{here}.emulated_press:PressEmulators",
        )
    ]
