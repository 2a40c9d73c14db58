"""kill -9 of a run; the long version is benchmarks/kill_nine.py."""

import subprocess
import sys

from tactbench.core.matrix.store import Store
from tests.conftest import Verbs
from tests.core.pool.patience import ending, processes_in, until

RUN = ("run", "--sensor", "ideal", "--task", "force", "--estimator", "ols", "--repeats", "2", "--jobs", "2",
       "--out", "out")  # fmt: skip


def test_a_killed_run_leaves_no_process_and_loses_only_what_was_at_work(tmp_path):
    out, nowhere = tmp_path / "out", subprocess.DEVNULL
    with ending([sys.executable, "-m", "tactbench", *RUN], cwd=tmp_path, stdout=nowhere, stderr=nowhere) as run:
        assert until(lambda: any((out / "cells").glob("[!.]*.h5")), 60)
        run.kill()
        run.wait()
    assert until(lambda: not processes_in(tmp_path)), processes_in(tmp_path)
    finished = {path: path.read_bytes() for path in out.rglob("[!.]*.h5")}
    assert 0 < len(Store(out).rows()) < 6
    Verbs(tmp_path, here=True)(*RUN)
    assert {path: path.read_bytes() for path in finished} == finished
    assert [row["status"] for row in Store(out).rows()] == ["done"] * 6
    assert not [path for path in out.rglob("*") if path.suffix in (".partial", ".completing")]
