"""A pad of four places that read three components of force each [N], on a serial line with a clock of its own."""

from tactbench.plugin import (
    ChannelSpec,
    DataSheet,
    PhysicalRange,
    SensorDescriptor,
    SensorSpec,
    Source,
    StreamSpec,
    assumed,
    hookimpl,
)
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinSheet

TACTBENCH_API = 2
WHY = "its maker"
STATED = Source(tag="assumed", reference=WHY)
PLACES = ((-2e-3, -1.1e-3, 0.0), (-2e-3, 1.1e-3, 0.0), (2e-3, -1.1e-3, 0.0), (2e-3, 1.1e-3, 0.0))
CHANNELS = tuple(
    ChannelSpec(name=f"{axis}{n}", site=f"site{n}", kind="taxel", unit="N", lower=-20, upper=20, sign=axis == "z",
                rest=assumed(0, "N", WHY), position_m=place, normal=(0.0, 0.0, 1.0))
    for n, place in enumerate(PLACES, 1) for axis in "xyz"
)  # fmt: skip
SPEC = SensorSpec(
    name="sound-grip", title="A pad", principle="capacitive", principle_source=STATED,
    streams=(StreamSpec(name="forces", rate_hz=200.0, dtype="float32", channels=CHANNELS),),
    skin=BondedLayer(
        sheet=SkinSheet(x_min=assumed(-5, "mm", WHY), x_max=assumed(5, "mm", WHY), arc=assumed(6, "mm", WHY),
                        cells=(20, 12)),
        young=assumed(0.5, "MPa", WHY), poisson=assumed(0.3, "1", WHY), thickness=assumed(2, "mm", WHY),
        contact_stiffness=assumed(15, "MPa/mm", WHY),
    ),
    reads_shear=("taxel",),
    link_delay=assumed(3, "ms", WHY),
    nuisances={"taxel": Nuisances(white=assumed(0.002, "N", WHY), step=assumed(0.001, "N", WHY))},
    data_sheet=DataSheet(force_range=PhysicalRange(lower=0.0, upper=10.0, unit="N", source=STATED)),
)  # fmt: skip


@hookimpl
def tactbench_sensors():
    return [SensorDescriptor(spec=SPEC, transducer="sound_grip.code:build", driver="sound_grip.code:Grip",
                             emulator="sound_grip.code:GripEmulator", emulated_link="bytes")]  # fmt: skip
