"""A slide, from the scene to the file and back."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

from tactbench.core.acquisition import acquire
from tactbench.core.evaluation.channels import channels_for
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.recording.reader import open_recording
from tactbench.plugin import (
    ChannelTarget,
    ForceRamp,
    Indenter,
    Placement,
    RigDescriptor,
    Scene,
)
from tactbench.plugin.simulation import Environment, Slide, Surface
from tests.rigs.twin.conftest import SILENT, TWIN, q

DESCRIPTOR = RigDescriptor(name="twin", title="Twin", where="tactbench.rigs.twin.rig:build", simulated=True)
EDGES = (2, 10, 30, 100, 200, 500, 1000)
CAP = Indenter(radius=q(20.0))
NOMINAL = Placement(scatter=q(0.0))
"""So that all recordings of one load share one contact."""


def _held(force=0.5, seconds=8.0, **more):
    return ForceRamp(start=q(force, "N"), end=q(force, "N"), hold=q(0.0, "s"), duration=q(seconds, "s"),
                     samples=int(100 * seconds), **more)  # fmt: skip


def _slide(speed, start=1.0, **more):
    return Slide(speed=q(speed, "mm/s"), start=q(start, "s"), **more)


@pytest.fixture
def record(sensors, tmp_path):
    def make(sensor="biotac", name="slide", **scene):
        scene = Scene(name=name, indenter=CAP, placement=NOMINAL, **{"observe": ("ac_pressure",), **scene})
        path = tmp_path / f"{name}.h5"
        path.unlink(missing_ok=True)
        request = RecordingRequest(sensors[sensor], DESCRIPTOR, scene, path, seed=1)
        meta = acquire(TWIN, request, clock=time.monotonic)
        with open_recording(path) as recording:
            recording.verify()
            return meta, {stream: recording.read(stream) for stream in recording.stream_names}

    return make


def _bands(counts, rate_hz=2200.0):
    window = np.hanning(counts.size)
    power = 2 * np.abs(np.fft.rfft((counts - counts.mean()) * window)) ** 2 / (counts.size * np.sum(window**2))
    f = np.fft.rfftfreq(counts.size, 1 / rate_hz)
    return [float(np.sqrt(power[(f >= low) & (f < high)].sum())) for low, high in itertools.pairwise(EDGES)]


def _columns(stream):
    return dict(zip([channel.name for channel in stream.spec.channels], stream.data.T, strict=True))


def test_a_minute_of_sliding_comes_back_from_its_file(record):
    ramp = ForceRamp(samples=2000)
    meta, streams = record(profile=ramp, slide=_slide(20.0, 20.0, duration=q(30.0, "s"), direction=q(90.0, "deg")))
    vibration, force = streams["vibration"], streams["force_torque"]
    assert vibration.data.shape == (132000, 1)
    np.testing.assert_array_equal(vibration.t_ns, np.round(np.arange(132000) / 2200 * 1e9).astype(np.int64))
    assert vibration.data.dtype == np.uint16
    assert meta.scene.slide.speed.to("mm/s") == 20.0
    kinds = [(channel.name, channel.kind) for channel in force.spec.channels]
    assert kinds == [
        ("fz", "force"), ("fx", "force"), ("fy", "force"), ("slip", "position"), ("slipping", "other"),
        ("stick_ratio", "other"), ("normal", "force"), ("tangential", "force"),
    ]  # fmt: skip
    found, t_s = _columns(force), force.t_ns / 1e9
    before, moving = t_s < 20, (t_s > 20) & (t_s < 50)
    assert not found["slipping"][before].any()
    assert set(np.unique(found["slipping"])) == {0.0, 1.0}
    # Stick-slip: it does both, all the time.
    assert 0.02 < found["slipping"][moving].mean() < 0.5
    assert np.all(found["stick_ratio"][found["slipping"] == 1] == 0)
    assert np.all(found["stick_ratio"][(found["slipping"] == 0) & (t_s > 8)] > 0)
    # The surface moves 600 mm; the skin under it follows by what friction holds, less than a millimetre.
    assert not found["slip"][before].any()
    assert 0.599 < found["slip"][-1] < 0.6
    # The sensor's own forces, across the surface and along its motion.
    np.testing.assert_array_equal(found["normal"], found["fz"])
    np.testing.assert_allclose(found["tangential"], found["fy"], atol=1e-12)
    # Across the finger: fx is the sensor's noise alone (0.6875 N), fy is carried along.
    assert found["fx"].std() == pytest.approx(0.6875, rel=0.05)
    assert found["fy"][(t_s > 45) & (t_s < 50)].mean() > 1.0
    assert meta.drawn["slips"] > 100
    counts = vibration.data[:, 0].astype(float)
    assert _bands(counts[50000:100000])[4] > 2 * _bands(counts[:40000])[4]


def test_the_force_task_still_picks_the_normal_force(sensors, tmp_path):
    scene = Scene(name="both", profile=_held(), slide=_slide(20.0), observe=("taxel",))
    path = tmp_path / "both.h5"
    acquire(TWIN, RecordingRequest(sensors["icub"], DESCRIPTOR, scene, path, seed=1), clock=time.monotonic)
    with open_recording(path) as recording:
        (found,) = channels_for(recording, ChannelTarget(kind="force"))
        assert found[2].name == "normal"
        (across,) = channels_for(recording, ChannelTarget(kind="force", name="fx"))
        assert across[2].name == "fx"


def test_every_component_of_the_force_has_its_noise_and_its_low_pass(record):
    def spread(filtered):
        more = {"force_filter": q(1.0, "Hz")} if filtered else {}
        environment = Environment(force_noise=q(0.5, "N"), **more)
        slide = _slide(200.0, 0.0, direction=q(90.0, "deg"))
        _, streams = record(profile=_held(), environment=environment, slide=slide)
        found = _columns(streams["force_torque"])
        return [found[name][100:].std() for name in ("fx", "fy", "fz")], found["slipping"]

    (raw, _), (smooth, slip) = spread(False), spread(True)
    # 700 numbers: a standard deviation errs by 3 %.
    assert raw == pytest.approx([0.5] * 3, rel=0.12)
    assert max(smooth) < 0.2
    assert set(np.unique(slip)) <= {0.0, 1.0}


def test_a_surface_of_an_earlier_recording_is_read_by_its_wavelength():
    given = Surface().model_dump(exclude={"roll_off", "hurst"}) | {"wavelength": q(6.25), "spread": 0.5}
    assert Surface.model_validate(given).roll_off == q(6.25)


def test_a_profile_that_passes_is_read_like_a_force_that_changes(record):
    rough = Surface(roughness=q(200.0, "um"))

    def read(force=1.0, slide=None):
        held = _held(force).model_copy(update={"samples": 400})
        _, streams = record("icub", profile=held, observe=("taxel",), environment=SILENT, slide=slide)
        return streams["taxels"].data.astype(float), _columns(streams["force_torque"])["fz"]

    (still, _), (moving, force) = read(), read(slide=_slide(20.0, surface=rough))
    (less, _), (more, _) = read(0.8), read(1.2)
    np.testing.assert_array_equal(still[:50], moving[:50])
    assert not (force[:50] - 1.0).any()
    assert force[50:].std() > 0.05
    # Per newton by two still recordings. Each of the four is rounded to a count; the profile counts in first order.
    expected = (force - 1.0)[:, None] * (more - less) / 0.4
    assert np.abs(moving - still - expected).max() < 2.0 + 0.1 * np.abs(expected).max()
    assert np.abs(expected).max() > 4.0


def test_sliding_over_an_even_surface_disturbs_no_slow_channel(record):
    held = _held().model_copy(update={"samples": 400})
    slides = (None, _slide(20.0, surface=Surface(roughness=q(0.0, "um"))))
    still, moving = (
        record(profile=held, observe=("dc_pressure",), slide=slide)[1]["electrodes"].data for slide in slides
    )
    np.testing.assert_array_equal(still, moving)
