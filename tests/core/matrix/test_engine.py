"""Which engine carries out which cells."""

import re

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.store import Store
from tactbench.core.pool.in_process import InProcess
from tactbench.core.pool.pool import Pool
from tests.conftest import Shell
from tests.core.cost.test_ladder import presses
from tests.core.matrix.test_evil_cells import run


def test_one_cell_in_process_is_really_here():
    assert isinstance(EngineChoice("in-process").engine(1), InProcess)
    assert isinstance(EngineChoice("in-process").engine(2), Pool)
    assert isinstance(EngineChoice().engine(1), Pool)


@pytest.mark.parametrize("choice", [EngineChoice("in-process", jobs=2), EngineChoice(scheduler="tcp://127.0.0.1:1")])
def test_what_does_not_go_together_is_refused(choice):
    with pytest.raises(UsageError):
        choice.check()


def test_in_process_cells_of_one_estimator_share_a_process_and_one_that_aborts_costs_its_row(tmp_path):
    presses(tmp_path / "shelf")
    names = [word for name in ("evil-abort", "evil-print") for word in ("--estimator", name)]
    run(Shell(tmp_path), *names, "--repeats", "2", "--no-latency", "--engine", "in-process")
    rows = list(Store(tmp_path / "out").rows())
    assert [row["status"] for row in rows if row["estimator"] == "evil-abort"] == ["crashed", "crashed"]
    pids = [re.search(r"in process (\d+)", row["log"])[1] for row in rows if row["estimator"] == "evil-print"]
    assert len(pids) == 2
    assert pids[0] == pids[1]
