"""Counters over their wraps, and rows lost, doubled and late: counts are exact."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.samples import Block, Quality
from tactbench.devices.driver import SequenceCheck
from tactbench.plugin.devices import Unwrap


@settings(max_examples=60)
@given(
    st.sampled_from([8, 16, 32]),
    st.lists(st.sampled_from([1, 1, 1, 0, -3, 5, 100]), max_size=80),
    st.lists(st.integers(0, 80), max_size=12),
)
def test_counts_are_exact_over_wraps_gaps_duplicates_and_late_rows(bits, steps, cuts):
    highest = (1 << bits) - 10
    came, done = [highest], {"duplicates": 0, "late": 0, "gaps": 0}
    for step in steps:
        came.append(highest + step)
        done["gaps"] += max(0, step - 1)
        done["duplicates"] += step == 0
        done["late"] += step < 0
        highest += max(0, step)
    unwrap, check = Unwrap(bits), SequenceCheck()
    raw = np.array(came) % (1 << bits)
    kept: list[Block] = []
    for first, last in pairwise(sorted([0, len(came), *(min(cut, len(came)) for cut in cuts)])):
        numbers = unwrap(raw[first:last].astype(np.uint32))
        assert numbers.tolist() == came[first:last]
        block = check(Block("s", None, numbers[:, None].astype(np.float64), sequence=numbers))
        kept += [] if block is None else [block]
    found = {"duplicates": check.duplicates, "late": check.late, "gaps": check.gaps}
    rows = [row for block in kept for row in block.sequence.tolist()]
    assert found == done
    assert rows == sorted(set(rows))
    assert check.received == len(came) == len(rows) + check.duplicates + check.late
    marked = [
        number
        for block in kept
        if block.quality is not None
        for number, marks in zip(block.sequence.tolist(), block.quality, strict=True)
        if marks[0] & Quality.GAP
    ]
    assert marked == [after for before, after in pairwise(rows) if after > before + 1]
    assert all(np.array_equal(block.data[:, 0], block.sequence) for block in kept)


def test_marks_are_added_to_those_that_are_there():
    check = SequenceCheck()
    quality = np.array([[0, Quality.SUSPECT], [Quality.SATURATED, 0], [0, 0]], dtype=np.uint8)
    block = Block("s", np.arange(3), np.zeros((3, 2)), quality, np.array([4, 6, 6]), np.arange(10, 13))
    kept = check(block)
    assert kept.quality.tolist() == [[0, Quality.SUSPECT], [Quality.SATURATED | Quality.GAP, Quality.GAP]]
    assert kept.t_ns.tolist() == [0, 1]
    assert kept.device_ns.tolist() == [10, 11]
    assert quality[1, 1] == 0, "the driver's own array is left as it is"


def test_rows_without_numbers_and_rows_in_order_pass_as_they_are():
    check = SequenceCheck()
    bare = Block("s", None, np.zeros((2, 1)))
    assert check(bare) is bare
    numbered = Block("s", None, np.zeros((2, 1)), sequence=np.array([5, 6]))
    assert SequenceCheck()(numbered) is numbered
    assert check.received == 2
