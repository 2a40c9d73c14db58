"""A press in real time: emulators, guard and rig in processes of their own, as with real devices."""

from __future__ import annotations

import subprocess
import sys

from tactbench.core.recording.reader import open_recording
from tests.rigs.parallel_manipulator.spring import EXAMPLE

CHANGES = {
    "time: virtual ": "time: real ",
    "settle_s: 8.0": "settle_s: 1.0",
    # Other work of this machine stops each of the processes for longer than what a rig of its own needs.
    "rated_force_n: 25.0": "rated_force_n: 25.0\n    force_age_ms: 250.0",
    "heartbeat_ms: 60.0": "heartbeat_ms: 1000.0",
    "version: 1": "version: 1\nallowed: {lost_percent: 100.0}",
}


def test_a_press_goes_through_driver_guard_process_and_emulators_in_real_time(tmp_path):
    """The sender of the force was a thread of the rig's process, which held it up for longer than the guard allows."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for old, new in CHANGES.items():
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "rig.yaml").write_text(text, encoding="utf-8")
    words = ["record", "--rig-file", "rig.yaml", "--sensor", "icub", "--profile", "ramp:duration=6", "--out", "p.h5"]
    done = subprocess.run(
        [sys.executable, "-m", "tactbench", *words], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    with open_recording(tmp_path / "p.h5") as recording:
        recording.verify()
        meta, force, taxels = recording.meta, recording.read("force_torque"), recording.read("taxels")
    assert (meta.emulation.time, meta.clock, meta.excluded) == ("real", "host", "")
    assert set(meta.emulation.devices) >= {"icub", "force", "motor", "joint-1", "joint-2", "joint-3"}
    assert meta.assumptions["noise_scale"] == 1.0  # what the simulation said in its own process
    # It was pressed, the motor's way came back as force, and the sensor answered to it.
    at_s = 1e-9 * (force.t_ns - force.t_ns[0])
    pressed, idle = force.data[at_s > 5.0, 2].mean(), force.data[at_s < 1.0, 2].mean()
    assert pressed > idle + 2.0
    assert abs(taxels.data[-20:].mean(axis=0) - taxels.data[:20].mean(axis=0)).max() > 5
