"""One axis of a stage with GRBL 1.1, in machine coordinates: it presses under force as any Positioner does.

Sourced: gnea/grbl, doc/markdown (interface, jogging). Soft limits ($20=1) and homing ($22=1) must be switched on. A board
that resets when its port is opened stops then, and forgets its place: it cannot retreat after its guard has died.
"""

from tactbench.plugin import hookimpl
from tactbench.plugin.devices import DeviceDescriptor

TACTBENCH_API = 2


@hookimpl
def tactbench_devices() -> list[DeviceDescriptor]:
    """Offer the stage."""
    where = {"driver": f"{__name__}.driver:GcodeStage", "emulator": f"{__name__}.emulator:GrblEmulator"}
    title = "one axis of a stage that speaks G-code (GRBL 1.1)"
    return [DeviceDescriptor(name="gcode-stage", title=title, kind="motor", emulated_link="bytes", **where)]
