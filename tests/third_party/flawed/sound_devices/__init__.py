"""A pad of four taxels, a force sensor, a stage and an axis that moves, on serial lines."""

from tactbench.plugin import (
    ChannelSpec,
    ManualFrame,
    SensorDescriptor,
    SensorSpec,
    Source,
    StreamSpec,
    assumed,
    hookimpl,
)
from tactbench.plugin.devices import DeviceDescriptor
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinSheet

TACTBENCH_API = 2
WHY = "its maker"
PLACES = ((-3e-3, -1.5e-3, 0.0), (-3e-3, 1.5e-3, 0.0), (2e-3, -1.5e-3, 0.0), (2e-3, 1.5e-3, 0.0))
TAXELS = tuple(
    ChannelSpec(name=f"t{n}", kind="taxel", lower=-2048, upper=2047, rest=assumed(100, "count", WHY), sign=1,
                position_m=place, normal=(0.0, 0.0, 1.0))
    for n, place in enumerate(PLACES, 1)
)  # fmt: skip
SKIN = BondedLayer(
    sheet=SkinSheet(x_min=assumed(-6, "mm", WHY), x_max=assumed(6, "mm", WHY), arc=assumed(12, "mm", WHY),
                    cells=(24, 24)),
    young=assumed(0.5, "MPa", WHY), poisson=assumed(0.3, "1", WHY), thickness=assumed(2, "mm", WHY),
    contact_stiffness=assumed(15, "MPa/mm", WHY),
)  # fmt: skip
SPEC = SensorSpec(
    name="sound-pad", title="A pad", principle="capacitive", principle_source=Source(tag="sourced", reference=WHY),
    streams=(StreamSpec(name="taxels", rate_hz=100.0, dtype="int16", channels=TAXELS),),
    skin=SKIN,
    reads_shear=(),
    parameters={"gain": assumed(400, "count/MPa", WHY)},
    link_delay=assumed(2, "ms", WHY),
    nuisances={"taxel": Nuisances(white=assumed(1, "count", WHY), step=assumed(1, "count", WHY))},
)  # fmt: skip
FRAME = {"t1": 300.0, "t2": -120.0, "t3": 5.0, "t4": 2000.0}
ON_THE_LINE = {"emulated_link": "bytes"}


@hookimpl
def tactbench_sensors():
    return [SensorDescriptor(spec=SPEC, transducer="sound_devices.transduction:build",
                             driver="sound_devices.line:Pad", emulator="sound_devices.line:PadEmulator",
                             manual_frame=ManualFrame(data="A5 07 2C 01 88 FF 05 00 D0 07 3C", readings=FRAME),
                             **ON_THE_LINE)]  # fmt: skip


@hookimpl
def tactbench_devices():
    return [
        DeviceDescriptor(name="sound-scale", title="A force sensor", kind="force", driver="sound_devices.line:Scale",
                         emulator="sound_devices.line:ScaleEmulator", **ON_THE_LINE),
        DeviceDescriptor(name="sound-stage", title="A stage", kind="motor", driver="sound_devices.line:Stage",
                         emulator="sound_devices.line:StageEmulator", **ON_THE_LINE),
        DeviceDescriptor(name="sound-axis", title="An axis that moves", kind="motor", driver="sound_devices.axis:Axis",
                         emulator="sound_devices.axis:AxisEmulator", **ON_THE_LINE),
    ]  # fmt: skip
