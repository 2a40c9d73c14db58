"""Checks that read a recording alone: each variant of one fails the check that is meant for it, and no other."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.conformance.check import CHECKS
from tactbench.core.conformance.run import run_checks, subjects_named
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

RATE_HZ = 50.0
FORCE = StreamSpec(
    name="force_torque", rate_hz=RATE_HZ, channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1),)
)
VARIANTS = ("sound", "of another sensor", "with a dead channel", "with a clock that goes back", "at another rate",
            "beyond the limits", "in grams", "with the sign turned")  # fmt: skip


def written(path, variant, *, simulated=False):
    """Write a press on an iCub fingertip, whose readings fall by 20 counts a newton."""
    spec = installed().sensors["icub"].spec
    n = 200
    t_ns = (np.arange(n) / (RATE_HZ if variant != "at another rate" else 90.0) * 1e9).astype(np.int64)
    if variant == "with a clock that goes back":
        t_ns[120:] -= 1_000_000_000
    force = np.interp(np.arange(n), [0, 50, n], [0.0, 0.0, 5.0])
    sign = {"with the sign turned": -1.0}.get(variant, 1.0)
    level = 120.0 if variant == "with the sign turned" else 200.0
    spread = np.linspace(0.5, 1.0, 12)
    data = np.round(level - sign * 20.0 * np.outer(force, spread))
    stream = spec.streams[0]
    if variant == "beyond the limits":
        stream = stream.model_copy(update={"dtype": "int16"})
        data[7, 3] = 300.0
    quality = np.zeros(data.shape, np.uint8)
    if variant == "with a dead channel":
        quality[:, 2] = 1
    own = spec.model_copy(update={"streams": (stream,)})
    if variant == "of another sensor":
        own = own.model_copy(update={"name": "another"})
    meta = RecordingMeta(name="press", sensor=own, reference=(FORCE,), rig="bench", simulated=simulated, clock="host")
    if variant == "in grams":
        force = force * 1000 / 9.80665
        force[-1] = 1020.0
    with RecordingWriter(path, meta) as writer:
        writer.append(Block(stream.name, t_ns, data, quality=quality))
        writer.append(Block("force_torque", t_ns, force[:, None]))
    return path


@pytest.mark.parametrize("variant", VARIANTS)
def test_each_but_the_sound_one_fails(tmp_path, variant):
    (subject,) = subjects_named(installed(), "icub", ("sensor",))
    path = written(tmp_path / "press.h5", variant)
    others = {one.name for one in CHECKS} - {"recording-fits-the-spec"}
    failed = run_checks(subject, recording=path, isolated=False, without=others).failed
    assert [one.check for one in failed] == ([] if variant == "sound" else ["recording-fits-the-spec"])
    assert all(one.where for one in failed)


def test_a_real_unit_is_gold_and_a_simulated_one_is_not(tmp_path):
    (subject,) = subjects_named(installed(), "icub", ("sensor",))
    for simulated, level in ((False, "gold"), (True, "silver")):
        path = written(tmp_path / f"{level}.h5", "sound", simulated=simulated)
        report = run_checks(subject, recording=path, isolated=False, without=("import-is-light",))
        assert report.ok
        assert report.level == level
