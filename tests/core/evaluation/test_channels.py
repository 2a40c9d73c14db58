"""Clocks that nothing can be aligned by."""

import numpy as np
import pytest

from tactbench.core.errors import DataError
from tactbench.core.evaluation.channels import require_forward
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
