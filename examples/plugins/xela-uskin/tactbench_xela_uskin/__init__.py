"""XELA uSkin, 4 x 4 taxels of three axes, read over CAN as its early drivers did.

Sourced from github.com/o2as/ur-o2as (``o2as_xela_sensor/xela_sensor.py``): 1 Mbit/s; identifier 0x200 + board with 07 00
starts it; taxel i sends on 0x710 + i the bytes ?, X, Y, Z, ?, big-endian uint16. Assumed: what the first and last byte are,
that one board is on the bus, and how it is stopped. Makers' software of today speaks another protocol. Not tried on a real one.
"""

from tactbench.plugin import ChannelSpec, SensorDescriptor, SensorSpec, Source, Statement, StreamSpec, hookimpl
from tactbench.plugin import DataSheet as Sheet

TACTBENCH_API = 1
DRIVER = Source(tag="sourced", reference="github.com/o2as/ur-o2as @ 51579353, o2as_xela_sensor/xela_sensor.py")
TAXELS = 16

STREAM = StreamSpec(
    name="taxels",
    dtype="uint16",  # nobody states the rate
    channels=tuple(
        # Z is along the normal; X and Y may answer either way. Places: no source read so far states the pitch.
        ChannelSpec(name=f"t{taxel}{axis}", kind="taxel", lower=0, upper=65535, site=f"t{taxel}")
        for taxel in range(1, TAXELS + 1)
        for axis in "xyz"
    ),
)
SPEC = SensorSpec(
    name="xela-uskin",
    title="XELA uSkin 4 x 4",
    principle="magnetic",
    principle_source=Source(tag="sourced", reference="Tomo et al. 2018, IEEE RA-L 3(1): Hall-effect sensors"),
    streams=(STREAM,),
    data_sheet=Sheet(interface=Statement(text="CAN, 1 Mbit/s", source=DRIVER)),
    references=("Tomo et al. 2018, A New Silicone Structure for uSkin", DRIVER.reference),
)


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Offer the sensor: without a skin, it can be recorded and replayed, not simulated."""
    where = "tactbench_xela_uskin.driver"
    return [
        SensorDescriptor(spec=SPEC, driver=f"{where}:USkinDriver", emulator=f"{where}:Emulator", emulated_link="can")
    ]
