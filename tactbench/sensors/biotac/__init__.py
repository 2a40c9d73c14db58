"""The BioTac: 19 electrodes under a fluid film, with pressure and temperature (see ``docs/sensors.md``)."""

from __future__ import annotations

from tactbench.plugin import SensorDescriptor, hookimpl
from tactbench.sensors.biotac.spec import SPEC

TACTBENCH_API = 2


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Return the descriptor of the BioTac."""
    return [
        SensorDescriptor(
            spec=SPEC,
            transducer="tactbench.sensors.biotac.transduction:build",
            driver="tactbench.sensors.biotac.driver:BioTacDriver",
            emulator="tactbench.sensors.biotac.emulator:build_emulator",
            emulated_link="spi",
            log_reader="tactbench.sensors.biotac.text_log:read_log",
        )
    ]
