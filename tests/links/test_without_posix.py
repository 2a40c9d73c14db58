"""Serial and CAN devices where fcntl, termios and fork are missing, as on Windows: tried by taking them away."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from tests.links.ends import pty

SITE = """
import os, sys

class Gone:
    def find_spec(self, name, path=None, target=None):
        frame = sys._getframe(1)
        while frame is not None:
            if frame.f_globals.get("__name__", "").partition(".")[0] in ("serial", "psutil"):
                return None  # their own use on Linux
            frame = frame.f_back
        if name in ("fcntl", "termios", "tty", "pty", "resource", "pwd"):
            raise ImportError(f"there is no {name} here")

sys.meta_path.insert(0, Gone())
for name in ("fork", "forkpty", "register_at_fork"):
    delattr(os, name)
"""
SPEAKS = """
import sys
from tactbench.plugin.devices import CanFrame, open_link

with open_link(f"serial://{sys.argv[1]}?baud=9600") as link:
    link.write(b"ask")
    assert link.read(10.0).data == b"A"
with open_link(f"can://slcan/{sys.argv[1]}?bitrate=1000000&sleep_after_open=0") as link:
    link.send(CanFrame(0x123, b"B"))
    assert link.receive(10.0).data == b"C"
"""
RIG = """
rig: bench
sensors: {biotac: {link: emulated}}
force: {device: net-ft, link: emulated, options: {counts_per_newton: 1.0e+6, counts_per_newton_metre: 1.0e+6}}
"""


@pytest.fixture
def without_posix(tmp_path):
    """Run Python in a child without what Windows lacks."""
    (tmp_path / "sitecustomize.py").write_text(SITE, encoding="utf-8")
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}

    def run(*words):
        done = subprocess.run([sys.executable, *words], cwd=tmp_path, env=env, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done

    return run


@pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")
def test_a_serial_port_and_a_can_adapter_are_spoken_to(without_posix):
    with pty() as far:

        def answer():
            far.read_until(b"ask")
            far.write(b"A")
            far.read_until(b"t123142\r")
            far.write(b"t123143\r")

        thread = threading.Thread(target=answer)
        thread.start()
        without_posix("-c", SPEAKS, far.name)
        thread.join()


def test_drivers_and_emulators_record_a_press(without_posix, tmp_path):
    (tmp_path / "rig.yaml").write_text(RIG, encoding="utf-8")
    words = ["record", "--rig-file", "rig.yaml", "--sensor", "biotac", "--profile", "ramp:duration=2", "--out", "p.h5"]
    without_posix("-m", "tactbench", *words)
    assert (tmp_path / "p.h5").exists()
