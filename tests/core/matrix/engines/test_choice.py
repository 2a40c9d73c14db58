"""Which engine carries out which cells."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.matrix.engines.choice import EngineChoice
from tactbench.core.matrix.engines.in_process import InProcess
from tactbench.core.matrix.pool.limits import Limits


@pytest.mark.parametrize(
    ("choice", "cells", "name"),
    [
        (EngineChoice(), 1, "in-process"),
        (EngineChoice(), 2, "isolated"),
        (EngineChoice(limits=Limits(timeout_s=1.0)), 1, "isolated"),
        (EngineChoice(limits=Limits(memory_mb=1)), 1, "isolated"),
        (EngineChoice("in-process"), 5, "in-process"),
        (EngineChoice("isolated"), 1, "isolated"),
        (EngineChoice("dask"), 1, "dask"),
    ],
)
def test_one_cell_is_carried_out_here_and_more_or_limited_ones_apart(choice, cells, name):
    assert choice.named(cells) == name


def test_one_cell_in_process_is_really_here():
    assert isinstance(EngineChoice().engine(1), InProcess)
    assert EngineChoice().here(1)


def test_a_cell_is_timed_beside_as_many_as_there_are():
    assert EngineChoice("isolated", jobs=4).concurrency(9) == 4
    assert EngineChoice("isolated", jobs=4).concurrency(3) == 3
    assert EngineChoice("in-process").concurrency(9) == 1


@pytest.mark.parametrize("choice", [EngineChoice("in-process", jobs=2), EngineChoice(scheduler="tcp://127.0.0.1:1")])
def test_what_does_not_go_together_is_refused(choice):
    with pytest.raises(UsageError):
        choice.checked()
