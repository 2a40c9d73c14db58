"""Another maker's plugin that takes the name of Acme's sensor."""

from acme_tactile import SPEC

from tactbench.plugin import SensorDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_sensors():
    return [SensorDescriptor(spec=SPEC)]
