"""Recordings of released format versions are kept in ``tests/recordings`` and read for ever.

Never write such a file anew: if this test fails, the reader has lost the ability to read what people have.
"""

from pathlib import Path

import numpy as np

from tactbench.core.recording.reader import open_recording

KEPT = Path(__file__).resolve().parents[2] / "recordings"


def test_version_1():
    with open_recording(KEPT / "v1" / "press.h5") as recording:
        recording.verify()
        assert recording.content_digest() == "e0fe66813c781466c2ecb4453c79c0a95bfe3fb75e7b41a3bbd2aecb3db4640f"
        meta, taxels, force = recording.meta, recording.read("taxels"), recording.read("force_torque")
    assert (meta.sensor.name, meta.session, meta.role, meta.labels["cap_radius_mm"]) == ("pad", "a", "train", 5.0)
    assert meta.sensor.streams[0].channels[1].position_m == (0.001, 0.0, 0.0)
    assert np.array_equal(taxels.data, np.arange(18).reshape(6, 3))
    assert taxels.data.dtype == np.uint16
    assert np.array_equal(taxels.t_ns, np.arange(6) * 10_000_000)
    assert np.argwhere(taxels.quality).tolist() == [[2, 1]]
    assert taxels.annotations["object"].tolist() == ["ball", "ball", "", "Bär", "cup", "cup"]
    assert taxels.annotations["press"].tolist() == [0, 0, 0, 1, 1, 1]
    assert np.array_equal(force.data[:, 0], np.linspace(0, 2.5, 6))
