"""AnySkin and ReSkin: five magnetometers under a magnetic skin, read over a serial port, and on the simulated rig.

Sourced from github.com/raunaqbhirangi/anyskin (``anyskin/sensor.py``, ``arduino/5X_binary_burst_stream``): five MLX90393,
each T, X, Y, Z, little-endian float32, then CR LF; 115200 baud. Assumed: places, skin, magnets and noise. It has not been
tried on a real one.
"""

from tactbench.plugin import ChannelSpec, Quantity, SensorDescriptor, SensorSpec, Source, StreamSpec, assumed, hookimpl
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinSheet

TACTBENCH_API = 2
FIRMWARE = Source(tag="sourced", reference="github.com/raunaqbhirangi/anyskin, arduino/5X_binary_burst_stream")
LINE_RATE = Source(tag="derived", reference="82 bytes of 10 bits at 115200 baud, the line's limit; USB may be faster")
WHY = "no source read so far states it"
PLACES_MM = ((0, 0), (6, 0), (0, 6), (-6, 0), (0, -6))


def guess(value: float, unit: str) -> Quantity:
    """Return a number that nobody has stated."""
    return assumed(value, unit, WHY)


# Sourced: Melexis, MLX90393 data sheet: fields up to 50 mT, -40 to 85 degC. A magnet that touches the chip stays below.
RANGE = ({"lower": -50_000, "upper": 50_000}, {"lower": -40, "upper": 85})

STREAM = StreamSpec(
    name="magnetometers",
    rate_hz=140.0,
    rate_source=LINE_RATE,
    dtype="float32",
    channels=tuple(
        # Fields may have either sign, and so may their answer to a press. That the library gives uT is assumed.
        ChannelSpec(name=f"m{site}{axis}", kind="dc_temperature" if axis == "t" else "taxel",
                    unit="degC" if axis == "t" else "uT", site=f"m{site}", **RANGE[axis == "t"],
                    position_m=(1e-3 * x, 1e-3 * y, 0.0), position_source=Source(tag="assumed", reference=WHY))
        for site, (x, y) in enumerate(PLACES_MM, 1)
        for axis in "txyz"
    ),
)  # fmt: skip
SHEET = SkinSheet(x_min=guess(-12, "mm"), x_max=guess(12, "mm"), arc=guess(24, "mm"), cells=(32, 32))
SPEC = SensorSpec(
    name="anyskin",
    title="AnySkin, five magnetometers",
    principle="magnetic",
    principle_source=FIRMWARE,
    streams=(STREAM,),
    skin=BondedLayer(
        sheet=SHEET, young=guess(0.2, "MPa"), poisson=guess(0.49, "1"), thickness=guess(2, "mm"),
        contact_stiffness=guess(10, "MPa/mm"),
    ),
    reads_shear=("taxel",),
    parameters={"magnet_height": guess(4, "mm"), "magnet_field": guess(1000, "uT"), "magnet_radius": guess(2, "mm")},
    nuisances={"taxel": Nuisances(white=guess(1, "uT"))},
    references=("Bhirangi et al. 2024, AnySkin", "github.com/raunaqbhirangi/anyskin, reskin_sensor"),
)  # fmt: skip


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Offer the sensor."""
    where, transducer = "tactbench_anyskin.driver", "tactbench_anyskin.transduction:build"
    code = {"driver": f"{where}:AnySkinDriver", "emulator": f"{where}:Emulator", "transducer": transducer}
    return [SensorDescriptor(spec=SPEC, emulated_link="bytes", **code)]
