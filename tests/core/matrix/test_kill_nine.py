"""kill -9 at random moments: the short version of the benchmark."""

import subprocess
import sys

import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import ROOT

from .made import kept, key


def test_killed_runs_lose_only_cells_in_flight():
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / "kill_nine.py"), "--kills", "5", "--matrix", "trivial",
         "--repeats", "30"],
        capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "5 kills (3 of the group, 2 of the parent)" in done.stdout


def test_the_check_of_the_benchmark_sees_damage(tmp_path, monkeypatch):
    """A check that cannot fail would prove nothing."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    import kill_nine

    with Store(tmp_path).hold() as store:
        kept(store, "a")
        kept(store, "b")
    before = kill_nine.checked(tmp_path, {})
    assert set(before) == {"a", "b"}
    file = tmp_path / "cells" / f"{key('a')}.h5"
    content = file.read_bytes()
    file.write_bytes(content[:-1])
    with pytest.raises(AssertionError):
        kill_nine.checked(tmp_path, before)
    file.unlink()
    with pytest.raises(AssertionError, match="was lost"):
        kill_nine.checked(tmp_path, before)
