"""Presses in real time: emulators, guard and rig in processes of their own, as with real devices."""

from __future__ import annotations

import gc
import time

import yaml

from tactbench.core.acquisition import acquire
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.recording.reader import open_recording
from tactbench.plugin import RigContext, load_registry
from tactbench.plugin.devices import RigFile
from tactbench.rigs.parallel_manipulator.rig import build
from tests.devices.emulating import emulating
from tests.rigs.parallel_manipulator.spring import EXAMPLE, ramp

REGISTRY = load_registry()


def impatient(tmp_path):
    """Return the example of one axis in real time, its moves quick, and late by whatever this machine makes it."""
    said = yaml.safe_load(EXAMPLE.with_name("fixed.yaml").read_text(encoding="utf-8"))
    settings = said["settings"]
    said["allowed"] = {"lost_percent": 100.0}
    said["force"] |= {"zero_s": 0.3, "range_n": 200.0}  # a short zero of the twin's noise drifts
    settings["limits"] |= {"force_age_ms": 1000.0, "heartbeat_ms": 2000.0, "rated_force_n": 2000.0}
    settings["force_loop"]["speed_mm_s"] = 2.0
    # After a zero that is so short, the twin's noise alone is a touch of 0.6 N at times.
    settings["touch"] |= {"touch_speed_mm_s": 2.0, "settle_s": 0.3, "lift_mm": 0.3, "allowed_n": 50.0, "mean_n": 1.5}
    settings["press"] |= {"stale_ms": 3000.0, "error_band_n": 6.0}
    settings["guard_log"] = str(tmp_path / "guard.log")
    said["devices"]["motor"]["options"] |= {"homing_speed_m_s": -0.02}
    return RigFile.model_validate(said)


def test_a_press_goes_through_driver_guard_process_and_emulators(tmp_path):
    """The sender of the force was a thread of the rig's process, which held it up for longer than the guard allows."""
    icub, described, scene = REGISTRY.sensors["icub"], REGISTRY.rigs["parallel-manipulator"], ramp(5.0, 0.3, 3.0)
    with emulating(impatient(tmp_path), tmp_path) as file:
        rig = build(RigContext(effects=tuple(REGISTRY.effects), rig_file=file))
        request = RecordingRequest(icub, described, scene, tmp_path / "a.h5", seed=7, rig_file=file)
        acquire(rig, request, clock=time.perf_counter)
        guard = rig._session.guard
        assert guard._process.poll() is None
        del rig
        gc.collect()
        assert guard._process.poll() == 0
    with open_recording(tmp_path / "a.h5") as recording:
        recording.verify()
        meta, force, taxels = recording.meta, recording.read("force_torque"), recording.read("taxels")
    assert (meta.emulation.time, meta.clock, meta.excluded) == ("real", "host", "")
    assert set(meta.emulation.devices) >= {"icub", "force", "motor"}
    assert meta.assumptions["noise_scale"] == 1.0  # of the simulation in its own process
    # It was pressed, the motor's way came back as force, and the sensor answered to it.
    at_s = 1e-9 * (force.t_ns - force.t_ns[0])
    assert force.data[at_s > 2.5, 2].mean() > force.data[at_s < 0.3, 2].mean() + 0.7
    assert abs(taxels.data[-10:].mean(axis=0) - taxels.data[:10].mean(axis=0)).max() > 5
    said = (tmp_path / "guard.log").read_text(encoding="utf-8")
    assert (said.count('"homing motor"'), said.count('"armed"}')) == (1, 2)
