"""AnySkin and ReSkin: five magnetometers under a magnetic skin, read over a serial port.

Sourced from github.com/raunaqbhirangi/anyskin (``anyskin/sensor.py``, ``arduino/5X_binary_burst_stream``): five MLX90393,
each T, X, Y, Z, little-endian float32, then CR LF; 115200 baud. It has not been tried on a real one.
"""

from tactbench.plugin import ChannelSpec, SensorDescriptor, SensorSpec, Source, StreamSpec, hookimpl

TACTBENCH_API = 1
FIRMWARE = Source(tag="sourced", reference="github.com/raunaqbhirangi/anyskin, arduino/5X_binary_burst_stream")
LINE_RATE = Source(tag="derived", reference="82 bytes of 10 bits at 115200 baud, the line's limit; USB may be faster")

STREAM = StreamSpec(
    name="magnetometers",
    rate_hz=140.0,
    rate_source=LINE_RATE,
    dtype="float32",
    channels=tuple(
        # Fields may have either sign, and so may their answer to a press. That the library gives uT is assumed.
        ChannelSpec(name=f"m{site}{axis}", kind="dc_temperature" if axis == "t" else "taxel",
                    unit="degC" if axis == "t" else "uT", site=f"m{site}")
        for site in range(1, 6)
        for axis in "txyz"
    ),
)  # fmt: skip
SPEC = SensorSpec(
    name="anyskin",
    title="AnySkin, five magnetometers",
    principle="magnetic",
    principle_source=FIRMWARE,
    streams=(STREAM,),
    references=("Bhirangi et al. 2024, AnySkin", "github.com/raunaqbhirangi/anyskin, reskin_sensor"),
)


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Offer the sensor: without a skin, it can be recorded and replayed, not simulated."""
    where = "tactbench_anyskin.driver"
    return [
        SensorDescriptor(
            spec=SPEC, driver=f"{where}:AnySkinDriver", emulator=f"{where}:Emulator", emulated_link="bytes"
        )
    ]
