"""The samples of a scene for emulated devices: the latest one of each channel, and no load outside the scene."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.plugin import Block, ChannelSpec, StreamSpec
from tactbench.plugin.devices import SceneSamples

MS = 1_000_000
"""Nanoseconds."""


def stream(name, *channels):
    return StreamSpec(name=name, channels=tuple(ChannelSpec(name=channel, kind="other") for channel in channels))


def scene_samples(duration_s, **more):
    """Two channels every 100 ms for a second, pressed from 300 ms on; the force ten times as often."""
    rows, often = np.arange(10), np.arange(100)
    data = np.column_stack([rows, 10 * rows]).astype(np.uint16)
    taxels = [Block("taxels", rows[part] * 100 * MS, data[part]) for part in (slice(0, 4), slice(4, 10))]
    force = Block("force_torque", often * 10 * MS, np.maximum(0.0, often - 30.0)[:, None])
    return SceneSamples(
        (stream("taxels", "a", "b"), stream("force_torque", "fz")), [*taxels, force], duration_s, **more
    )


@pytest.fixture
def samples():
    return scene_samples(1.0, rest_s=0.3)


@pytest.mark.parametrize(
    ("since_s", "a", "fz"),
    [(0.0, 0, 0), (0.0999, 0, 0), (0.1, 1, 0), (0.5599, 5, 25), (0.56, 5, 26)],
)
def test_every_channel_has_its_latest_sample(samples, since_s, a, fz):
    samples.start(7.0)
    assert samples(7.0 + since_s + 1e-9) == {"a": a, "b": 10 * a, "fz": fz}


@pytest.mark.parametrize("t_s", [0.0, 6.69, 8.0, 100.0])
def test_outside_the_scene_nothing_is_pressed_and_the_noise_goes_on(samples, t_s):
    samples.start(7.0)
    found = [samples(t_s + later_s) for later_s in np.arange(0.0, 0.3, 0.01)]
    assert {one["fz"] for one in found} == {0}
    assert {one["a"] for one in found} == {0, 1, 2}


def test_without_an_unloaded_stretch_the_first_sample_is_held():
    samples = scene_samples(1.0)
    samples.start(1.0)
    assert {samples(t_s)["a"] for t_s in (0.0, 0.99, 2.0, 2.15, 9.0)} == {0}
