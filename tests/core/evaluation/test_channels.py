"""Clocks that nothing can be aligned by."""

import numpy as np
import pytest

from tactbench.core.errors import DataError
from tactbench.core.evaluation.channels import nearest_rows, require_forward
from tactbench.core.samples import StreamData
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

SPEC = StreamSpec(name="taxels", channels=(ChannelSpec(name="t0", kind="taxel", unit="count"),))


def test_a_time_that_runs_backwards_is_refused_and_a_counter_is_not_to_be_sorted():
    with pytest.raises(DataError) as caught:
        require_forward(at(1000, 2000, 0, 3000), "press")
    assert "wraps_at" in caught.value.hint


def at(*times_ms):
    t_ns = np.array(times_ms, dtype=np.int64) * 1_000_000
    return StreamData(SPEC, t_ns, np.zeros((len(t_ns), 1)), None)


def test_rows_belong_to_the_nearest_within_half_a_step_and_of_two_to_the_earlier():
    found = nearest_rows(at(0, 10, 20, 30), at(5, 15, 25, 34), "press")
    assert found.tolist() == [0, 0, 1, 3]
    assert nearest_rows(at(0, 10, 20), at(0, 20, 40), "press").tolist() == [0, 0, 1]
    assert nearest_rows(at(0, 10, 26), at(0, 10), "press").tolist() == [0, 1, -1]
    assert nearest_rows(at(0, 10), at(), "press").tolist() == [-1, -1]


def test_without_a_clock_on_either_side_row_belongs_to_row():
    timeless = StreamData(SPEC, None, np.zeros((2, 1)), None)
    for pair in ((at(0, 10), timeless), (timeless, at(0, 10))):
        assert nearest_rows(*pair, "press").tolist() == [0, 1]
    with pytest.raises(DataError):
        nearest_rows(at(0, 10, 20), timeless, "press")
