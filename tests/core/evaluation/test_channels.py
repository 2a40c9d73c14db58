"""Clocks that nothing can be aligned by."""

import numpy as np
import pytest

from tactbench.core.errors import DataError
from tactbench.core.evaluation.channels import nearest_rows, require_forward
from tactbench.core.samples import StreamData
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

SPEC = StreamSpec(name="taxels", channels=(ChannelSpec(name="t0", kind="taxel", unit="count"),))


@pytest.mark.parametrize(
    ("t_ns", "step"),
    [
        ((2**32 - 50_000 + np.arange(10) * 10_000) % 2**32 * 1000, "wraps_at"),
        (np.array([1, 2, 0, 3]) * 10**9, "sort the rows"),
    ],
)
def test_the_step_fits_what_runs_backwards(t_ns, step):
    """Sorted, the rows of a counter that wraps would be in a wrong order."""
    with pytest.raises(DataError) as caught:
        require_forward(StreamData(SPEC, t_ns, np.zeros((len(t_ns), 1)), None), "press")
    assert [one for one in ("wraps_at", "sort the rows") if one in caught.value.hint] == [step]


def at(*times_ms):
    t_ns = np.array(times_ms, dtype=np.int64) * 1_000_000
    return StreamData(SPEC, t_ns, np.zeros((len(t_ns), 1)), None)


def test_rows_belong_to_the_nearest_within_half_a_step_and_of_two_to_the_earlier():
    found = nearest_rows(at(0, 10, 20, 30), at(5, 15, 25, 34), "press")
    assert found.tolist() == [0, 0, 1, 3]
    assert nearest_rows(at(0, 10, 20), at(0, 20, 40), "press").tolist() == [0, 0, 1]
    assert nearest_rows(at(0, 10, 26), at(0, 10), "press").tolist() == [0, 1, -1]
    assert nearest_rows(at(0, 10), at(), "press").tolist() == [-1, -1]
