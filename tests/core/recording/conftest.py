"""A small sensor, and recordings of it made through the front door."""

import numpy as np
import pytest

from tactbench.core.recording.writer import write_recording
from tactbench.core.samples import Block
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tests.core.evaluation.made import FORCE, sensor_of


def sensor(channels=3, dtype="uint16"):
    rest = assumed(7, "count", "test")
    taxels = (ChannelSpec(name=f"t{n}", kind="taxel", lower=0, upper=4095, rest=rest) for n in range(channels))
    return sensor_of(StreamSpec(name="taxels", dtype=dtype, channels=tuple(taxels)))


def about(channels=3, dtype="uint16", **fields):
    """Return what a recording of the sensor says of itself."""
    given = {"name": "press", "rig": "test", "reference": (FORCE,), **fields}
    return RecordingMeta(sensor=sensor(channels, dtype), **given)


@pytest.fixture
def write(tmp_path):
    """Writes a recording: ``write(data, force=None, t_ns=…, quality=None, notes={}, **meta)``."""

    def make(data, *, force=None, t_ns=None, quality=None, notes=None, **fields):
        meta = about(data.shape[1], **fields)
        times = np.arange(len(data)) * 10_000_000 if t_ns is None else t_ns
        timed = None if meta.clock == "none" else times
        path = tmp_path / f"{meta.name}.h5"
        blocks = [Block("taxels", timed, data, quality)]
        blocks += [] if force is None else [Block("force_torque", timed, force[:, None])]
        write_recording(path, meta, blocks, {"taxels": notes or {}})
        return path

    return make
