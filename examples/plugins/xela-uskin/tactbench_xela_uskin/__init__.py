"""XELA uSkin, 4 x 4 taxels of three axes, read over CAN as its early drivers did, and on the simulated rig.

Sourced from github.com/o2as/ur-o2as (``o2as_xela_sensor/xela_sensor.py``): 1 Mbit/s; identifier 0x200 + board with 07 00
starts it; taxel i sends on 0x710 + i the bytes ?, X, Y, Z, ?, big-endian uint16. Assumed: what the first and last byte are,
that one board is on the bus, how it is stopped; and for the simulation places, rest, skin, magnets, gain and noise. Makers'
software of today speaks another protocol. Not tried on a real one.
"""

from functools import partial

from tactbench.plugin import ChannelSpec, SensorDescriptor, SensorSpec, Source, Statement, StreamSpec, assumed, hookimpl
from tactbench.plugin import DataSheet as Sheet
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinSheet

TACTBENCH_API = 2
WHY = "no source read so far states it"
DRIVER = Source(tag="sourced", reference="github.com/o2as/ur-o2as @ 51579353, o2as_xela_sensor/xela_sensor.py")
TAXELS, REST = 16, 16384
PLACES_MM = tuple((5 * column - 7.5, 5 * row - 7.5) for row in range(4) for column in range(4))
guess = partial(assumed, reference=WHY)

STREAM = StreamSpec(
    name="taxels",
    dtype="uint16",  # nobody states the rate
    channels=tuple(
        # Z is along the normal; X and Y may answer either way.
        ChannelSpec(name=f"t{taxel}{axis}", kind="taxel", lower=0, upper=65535, site=f"t{taxel}", rest=guess(REST, "count"),
                    position_m=(1e-3 * x, 1e-3 * y, 0.0), position_source=Source(tag="assumed", reference=WHY))
        for taxel, (x, y) in enumerate(PLACES_MM, 1)
        for axis in "xyz"
    ),
)  # fmt: skip
SHEET = SkinSheet(x_min=guess(-12, "mm"), x_max=guess(12, "mm"), arc=guess(24, "mm"), cells=(32, 32))
SPEC = SensorSpec(
    name="xela-uskin",
    title="XELA uSkin 4 x 4",
    principle="magnetic",
    principle_source=Source(tag="sourced", reference="Tomo et al. 2018, IEEE RA-L 3(1): Hall-effect sensors"),
    streams=(STREAM,),
    skin=BondedLayer(sheet=SHEET, young=guess(0.2, "MPa"), poisson=guess(0.49, "1"), thickness=guess(4, "mm"),
                     contact_stiffness=guess(10, "MPa/mm")),
    reads_shear=("taxel",),
    parameters={"magnet_height": guess(5, "mm"), "magnet_radius": guess(1, "mm"), "gain": guess(20000, "count")},
    nuisances={"taxel": Nuisances(white=guess(5, "count"), step=guess(1, "count"))},
    data_sheet=Sheet(interface=Statement(text="CAN, 1 Mbit/s", source=DRIVER)),
    references=("Tomo et al. 2018, A New Silicone Structure for uSkin", DRIVER.reference),
)  # fmt: skip


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Offer the sensor."""
    where, transducer = "tactbench_xela_uskin.driver", "tactbench_xela_uskin.transduction:build"
    code = {"driver": f"{where}:USkinDriver", "emulator": f"{where}:Emulator", "transducer": transducer}
    return [SensorDescriptor(spec=SPEC, emulated_link="can", **code)]
