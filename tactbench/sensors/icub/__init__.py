"""The iCub fingertip: 12 capacitive taxels under foam (see ``docs/sensors.md``)."""

from __future__ import annotations

from tactbench.plugin import SensorDescriptor, hookimpl
from tactbench.sensors.icub.spec import SPEC

TACTBENCH_API = 2


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Return the descriptor of the iCub fingertip."""
    return [
        SensorDescriptor(
            spec=SPEC,
            transducer="tactbench.sensors.icub.transduction:build",
            driver="tactbench.sensors.icub.driver:FingertipDriver",
            emulator="tactbench.sensors.icub.emulator:build_emulator",
            emulated_link="can",
            log_reader="tactbench.sensors.icub.log:read_log",
        )
    ]
