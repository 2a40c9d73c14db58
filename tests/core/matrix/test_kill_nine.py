"""kill -9 at random moments, the short version of the benchmark; and a latency that is not measured."""

import subprocess
import sys

import pytest

from tests.conftest import ROOT


def test_killed_runs_lose_nothing_and_end_with_the_same_bytes():
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / "kill_nine.py"), "--kills", "5", "--matrix", "trivial",
         "--repeats", "30"],
        capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "5 kills (3 of the group, 2 of the parent)" in done.stdout
    assert "byte-equal to the undisturbed run's in every folder" in done.stdout


@pytest.mark.parametrize("damage", ["ledger", "shard"])
def test_the_check_of_the_benchmark_sees_damage(tmp_path, monkeypatch, damage):
    """A check that cannot fail would prove nothing."""
    from tactbench.core.matrix.store import Store

    from .store.made import kept, key

    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    import kill_nine

    with Store(tmp_path).hold() as store:
        kept(store, "a")
        kept(store, "b")
    before = kill_nine.checked(tmp_path, {})
    assert set(before) == {"a", "b"}
    if damage == "ledger":
        ledger = tmp_path / "index.jsonl"
        ledger.write_bytes(b"{torn" + ledger.read_bytes())
    else:
        shard = tmp_path / "cells" / f"{key('a')}.h5"
        shard.write_bytes(shard.read_bytes()[:-1] + b"x")
    with pytest.raises((AssertionError, ValueError)):
        kill_nine.checked(tmp_path, before)
    kept(Store(tmp_path), "b", 2.0, key=key("other"))
