"""Sensors whose flaws their author expects."""

from flawed_tactile.sensors import PAD, channel, with_
from tactbench.plugin import SensorDescriptor, hookimpl

TACTBENCH_API = 2
WHY = "the data sheet has it so"
EXPECTED_FAILURES = {
    "excuses-its-flaw": {"normals-are-unit": WHY},
    "excuses-what-it-passes": {"normals-are-unit": WHY},
    "excuses-what-is-no-check": {"normals-are-united": WHY},
}


@hookimpl
def tactbench_sensors():
    flawed = channel(normal=(0.0, 1.0, 1.0))
    return [
        SensorDescriptor(spec=with_(flawed if name == "excuses-its-flaw" else PAD, name=name))
        for name in EXPECTED_FAILURES
    ]
