"""Which engine carries out which cells."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.pool.in_process import InProcess
from tactbench.core.pool.pool import Pool


def test_one_cell_in_process_is_really_here():
    assert isinstance(EngineChoice("in-process").engine(1), InProcess)
    assert isinstance(EngineChoice("in-process").engine(2), Pool)
    assert isinstance(EngineChoice().engine(1), Pool)


@pytest.mark.parametrize("choice", [EngineChoice("in-process", jobs=2), EngineChoice(scheduler="tcp://127.0.0.1:1")])
def test_what_does_not_go_together_is_refused(choice):
    with pytest.raises(UsageError):
        choice.check()
