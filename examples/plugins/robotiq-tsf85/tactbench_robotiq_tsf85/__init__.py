"""Robotiq TSF-85: the 4 x 7 static taxels of one fingertip, asked over a serial port, and on the simulated rig.

Sourced from the package pyrobotiqtactile 0.1.2 (``protocol.py``, ``sensor.py``): the packets, 115200 baud, 4 x 7 taxels.
Assumed: principle, sizes, skin, gain, noise, and all that the module `driver` says so of. Not tried on a real one.
"""

from tactbench.plugin import ChannelSpec, Quantity, SensorDescriptor, SensorSpec, Source, StreamSpec, assumed, hookimpl
from tactbench.plugin.simulation import BondedLayer, Nuisances, SkinSheet

TACTBENCH_API = 2
WHY = "no source read so far states it"
GUESS = Source(tag="assumed", reference=WHY)
ROWS, COLUMNS, PITCH_MM, REST = 7, 4, 5.0, 500


def guess(value: float, unit: str) -> Quantity:
    """Return a number that nobody has stated."""
    return assumed(value, unit, WHY)


STREAM = StreamSpec(
    name="static",
    dtype="uint16",  # asked, so that the host makes the rate
    channels=tuple(
        ChannelSpec(
            name=f"r{row + 1}c{column + 1}", kind="taxel", lower=0, upper=65535, rest=guess(REST, "count"), sign=1,
            position_m=(1e-3 * PITCH_MM * (row - 3), 1e-3 * PITCH_MM * (column - 1.5), 0.0), normal=(0.0, 0.0, 1.0),
            position_source=GUESS,
        )
        for row in range(ROWS)
        for column in range(COLUMNS)
    ),
)  # fmt: skip
SHEET = SkinSheet(x_min=guess(-20, "mm"), x_max=guess(20, "mm"), arc=guess(25, "mm"), cells=(40, 25))
SPEC = SensorSpec(
    name="robotiq-tsf85",
    title="Robotiq TSF-85, static taxels",
    principle="capacitive",
    principle_source=GUESS,
    streams=(STREAM,),
    skin=BondedLayer(
        sheet=SHEET, young=guess(0.5, "MPa"), poisson=guess(0.45, "1"), thickness=guess(3, "mm"),
        contact_stiffness=guess(10, "MPa/mm"),
    ),
    parameters={"gain": guess(20000, "count/MPa")},
    nuisances={"taxel": Nuisances(white=guess(5, "count"), offset_own=guess(5, "count"), step=guess(1, "count"))},
    references=("PyPI: pyrobotiqtactile 0.1.2 (packets, fields)",),
)  # fmt: skip


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Offer the sensor."""
    where = "tactbench_robotiq_tsf85"
    code = {"transducer": "transduction:build", "driver": "driver:TSF85Driver", "emulator": "driver:Emulator"}
    named = {kind: f"{where}.{place}" for kind, place in code.items()}
    return [SensorDescriptor(spec=SPEC, emulated_link="bytes", **named)]
