"""A sensor maker's plugin: four taxels on a thick, soft, nearly incompressible layer."""

from tactbench.plugin import ChannelSpec, SensorDescriptor, SensorSpec, Source, StreamSpec, assumed, hookimpl
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinSheet

TACTBENCH_API = 2
MINE = "Acme data sheet"
PLACES_MM = ((-1.5, -1.5), (-1.5, 1.5), (1.5, -1.5), (1.5, 1.5))

SPEC = SensorSpec(
    name="acme-pad",
    title="Acme pad",
    principle="capacitive",
    principle_source=Source(tag="sourced", reference=MINE),
    streams=(
        StreamSpec(
            name="taxels",
            rate_hz=100.0,
            dtype="uint16",
            channels=tuple(
                ChannelSpec(
                    name=f"t{place}",
                    kind="taxel",
                    lower=0,
                    upper=4095,
                    rest=assumed(100, "count", MINE),
                    sign=1,
                    position_m=(x / 1e3, y / 1e3, 0.0),
                    normal=(0.0, 0.0, 1.0),
                )
                for place, (x, y) in enumerate(PLACES_MM, 1)
            ),
        ),
    ),
    skin=BondedLayer(
        sheet=SkinSheet(
            x_min=assumed(-6, "mm", MINE), x_max=assumed(6, "mm", MINE), arc=assumed(12, "mm", MINE), cells=(32, 32)
        ),
        young=assumed(0.5, "MPa", MINE),
        poisson=assumed(0.45, "1", MINE),
        thickness=assumed(4, "mm", MINE),
        contact_stiffness=assumed(10, "MPa/mm", MINE),
    ),
    nuisances={
        "taxel": Nuisances(
            white=assumed(1, "count", MINE), offset_own=assumed(1, "count", MINE), step=assumed(1, "count", MINE)
        )
    },
)


@hookimpl
def tactbench_sensors():
    return [SensorDescriptor(spec=SPEC, transducer="acme_tactile.transduction:build")]
