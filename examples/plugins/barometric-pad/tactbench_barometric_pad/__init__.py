"""A pad of eight barometers under rubber, made at home: no driver, no simulation, only recordings in CSV files."""

from tactbench.plugin import ChannelSpec, SensorDescriptor, SensorSpec, Source, StreamSpec, hookimpl

TACTBENCH_API = 2
MAKER = Source(tag="assumed", reference="an example: a pad that nobody has built; see mapping.yaml beside README.md")

SPEC = SensorSpec(
    name="barometric-pad",
    title="Barometric pad",
    principle="barometric",
    principle_source=MAKER,
    streams=(
        StreamSpec(
            name="barometers",
            rate_hz=50.0,
            rate_source=MAKER,
            channels=tuple(
                ChannelSpec(name=f"p{number}", kind="taxel", unit="hPa", sign=1, lower=300.0, upper=1250.0)
                for number in range(1, 9)
            ),
        ),
    ),
)


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Offer the sensor, so that `tactbench show` and `check` know it."""
    return [SensorDescriptor(spec=SPEC)]
