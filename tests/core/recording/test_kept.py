"""Recordings of released format versions are kept in ``tests/recordings`` and read for ever.

Never write such a file anew: if this test fails, the reader has lost the ability to read what people have.
"""

import numpy as np
import pytest

from tactbench.core.recording.clock_fit import host_times
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality
from tests.conftest import ROOT


def kept(version, digest):
    """Return the meta, the taxels and the force of a kept recording."""
    with open_recording(ROOT / "tests" / "recordings" / f"v{version}" / "press.h5") as recording:
        assert recording.verify() == digest
        assert recording.version == version
        return recording.meta, recording.read("taxels"), recording.read("force_torque")


@pytest.mark.parametrize(
    ("version", "digest"),
    [
        (2, "ec0bc4f35085db5b3da669083822bff1c8b37a39b1a4dfd6228c37f1ce7267c3"),
        (3, "fdf030b9e327789f876a8b93aa36e494cb12d1e45910b14b49e08cc30b65cd7b"),
        (4, "d740feeac823dfc55e6d38ef7dc182849dde96356cc8ae05d2d48fc7ad1eda67"),
    ],
)
def test_versions_from_2_on(version, digest):
    meta, taxels, _ = kept(version, digest)
    n = np.arange(180)
    assert (meta.emulation.time, [*meta.counts.values()]) == ("real", [1])
    clock = meta.clocks["taxels"]
    assert (clock.delay_ns, clock.wraps, clock.breaks) == ((200_000, 300_000), 1, 1)
    assert np.array_equal(taxels.device_ns, np.where(n < 100, n, n - 100) * 10_000_000)
    assert np.array_equal(taxels.t_ns, host_times(clock.segments, taxels.device_ns))
    assert np.argwhere(taxels.quality == Quality.GAP).tolist() == [[40, 0], [40, 1], [40, 2]]
    assert taxels.annotations["object"].tolist() == ["ball"] * 100 + ["Bär"] * 80


def test_version_1():
    meta, taxels, force = kept(1, "e0fe66813c781466c2ecb4453c79c0a95bfe3fb75e7b41a3bbd2aecb3db4640f")
    assert (meta.session, meta.labels["cap_radius_mm"]) == ("a", 5.0)
    assert np.array_equal(taxels.data, np.arange(18).reshape(6, 3))
    assert np.array_equal(taxels.t_ns, np.arange(6) * 10_000_000)
    assert np.argwhere(taxels.quality).tolist() == [[2, 1]]
    assert taxels.annotations["object"].tolist() == ["ball", "ball", "", "Bär", "cup", "cup"]
    assert np.array_equal(force.data[:, 0], np.linspace(0, 2.5, 6))
