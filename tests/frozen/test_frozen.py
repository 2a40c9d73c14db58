"""Scores stay what they were; those of the other cells are compared by hand, as make.py says."""

import json
import os
import subprocess
import sys

import pytest

from tests.conftest import ROOT
from tests.frozen.make import HERE, same, scores_of

WITHOUT_POSIX = """
import multiprocessing, os, sys
import psutil  # on Windows it has other code for this
sys.modules.update(dict.fromkeys(("fcntl", "resource", "termios", "pwd")))
for name in ("fork", "killpg", "sched_getaffinity", "setsid"):
    delattr(os, name)
multiprocessing.set_start_method("spawn")
"""
"""Run at the start of every interpreter: what only POSIX has is not there. Not the same as Windows."""


@pytest.mark.parametrize("site", ["", WITHOUT_POSIX], ids=["as it is", "without POSIX, spawned"])
def test_one_sensor_scores_what_it_did(tmp_path, site):
    (tmp_path / "sitecustomize.py").write_text(site)
    words = ("run", "--sensor", "icub", "--task", "force", "--repeats", "1", "--out", "out")
    path = {"PYTHONPATH": os.pathsep.join((str(tmp_path), str(ROOT)))}
    subprocess.run([sys.executable, "-m", "tactbench", *words], cwd=tmp_path, env={**os.environ, **path}, check=True)
    frozen = json.loads((HERE / "default.json").read_text())
    found = scores_of(tmp_path / "out")
    assert len(found) == 6
    for cell, now in found.items():
        assert same(frozen[cell], now), cell
