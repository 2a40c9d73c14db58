"""How many cores there are for us, and how many are wanted."""

import os
import sys

from tactbench.core.matrix.engines.cores import cores, wanted
from tests.core.matrix.engines.patience import ending, until


def test_only_the_cores_that_this_process_may_use_count():
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, sorted(allowed)[:1])
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, allowed)
    assert cores() == len(allowed)


def test_who_is_at_work_elsewhere_wants_a_core_as_well():
    with ending([sys.executable, "-c", "while True: pass"]):
        assert until(lambda: wanted() >= 2)
    assert wanted() >= 1
