"""Drivers and emulators where fcntl, termios and fork are missing, as on Windows: tried by taking them away."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

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


def test_drivers_and_emulators_record_a_press(without_posix, tmp_path):
    (tmp_path / "rig.yaml").write_text(RIG, encoding="utf-8")
    words = ["record", "--rig-file", "rig.yaml", "--sensor", "biotac", "--profile", "ramp:duration=2", "--out", "p.h5"]
    without_posix("-m", "tactbench", *words)
    assert (tmp_path / "p.h5").exists()
