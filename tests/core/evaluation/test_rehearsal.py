"""What estimators do before they are timed: learnt in a moment, and the process may still fork."""

import os
import subprocess
import sys

SCRIPT = """
import psutil
from tactbench.core.matrix.solve import rehearse
from tactbench.core.plugins.registry import installed, load_object

rehearsed = [(one, kind) for one in installed().estimators if one.rehearsal is not None for kind in one.kinds]
for one, kind in rehearsed:
    assert set(one.rehearsal) <= set(one.params), one.name
    built = load_object(one.where)(kind=kind, seed=0, threads=1, **{**one.params, **one.rehearsal})
    # What an import starts, as pyarrow's allocator does, is none of the estimator's.
    before = psutil.Process().num_threads()
    rehearse(built, kind)
    assert psutil.Process().num_threads() == before, one.name
print(len(rehearsed))
"""


def test_every_estimator_of_ours_can_be_rehearsed_and_leaves_no_thread():
    # One thread for BLAS, as the command line has it; what OpenMP would start is held back by the rehearsal.
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "4"}
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=env, timeout=120)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 10
