"""A sensor whose module imports a large package."""

import h5py  # noqa: F401

from flawed_tactile.sensors import PAD, with_
from tactbench.plugin import SensorDescriptor, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_sensors():
    return [SensorDescriptor(spec=with_(PAD, name="imports-h5py"))]
