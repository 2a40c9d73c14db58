"""A pad and a scale that send lines of text over a serial port."""

from tactbench.plugin import ChannelSpec, RigDescriptor, SensorDescriptor, SensorSpec, Source, StreamSpec, hookimpl
from tactbench.plugin.devices import DeviceDescriptor

TACTBENCH_API = 2

PAD = StreamSpec(
    name="taxels",
    channels=tuple(ChannelSpec(name=f"t{place}", kind="taxel", lower=0, upper=4095, sign=1) for place in (1, 2)),
)
SCALE = StreamSpec(name="scale", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))


@hookimpl
def tactbench_sensors():
    spec = SensorSpec(
        name="wired-pad",
        title="Wired pad",
        principle="resistive",
        principle_source=Source(tag="sourced", reference="its maker"),
        streams=(PAD,),
    )
    return [SensorDescriptor(spec=spec, driver="wired_tactile.driver:build")]


@hookimpl
def tactbench_devices():
    return [
        DeviceDescriptor(name="wired-scale", title="Wired scale", kind="force", driver="wired_tactile.driver:scale"),
        DeviceDescriptor(name="wired-motor", title="Wired motor", kind="motor", driver="wired_tactile.driver:build"),
    ]


@hookimpl
def tactbench_rigs():
    return [RigDescriptor(name="wired-rig", title="A pad on a line", where="wired_tactile.rig:WiredRig")]
