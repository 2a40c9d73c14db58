"""The queue between reading and writing: nothing is lost uncounted, and what is lost is marked where it is missing."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.samples import Block, Quality
from tactbench.devices.queue import MOST_BYTES, BlockQueue
from tactbench.devices.sequence import SequenceCheck
from tactbench.plugin import ChannelSpec, RigError, StreamSpec
from tactbench.plugin.devices import Unwrap
from tests.devices.test_sequence import arrivals

STREAM = StreamSpec(
    name="s", rate_hz=100.0, dtype="int16", channels=tuple(ChannelSpec(name=f"c{k}", kind="taxel") for k in range(2))
)


def rows_of(first: int, n: int, **more) -> Block:
    numbers = np.arange(first, first + n)
    return Block("s", 10 * numbers, np.stack([numbers, -numbers], 1).astype(np.int16), sequence=numbers, **more)


@settings(max_examples=150)
@given(arrivals(), st.lists(st.tuples(st.integers(0, 40), st.integers(0, 60)), min_size=1, max_size=40))
def test_received_is_written_plus_dropped_plus_duplicates_plus_late(case, turns):
    """Rows come in blocks, somebody takes some between them, at times too few."""
    bits, came, _ = case
    unwrap, check, queue = Unwrap(bits), SequenceCheck(), BlockQueue(STREAM, 0.5)
    raw = np.array(came) % (1 << bits)
    at, passed, taken = 0, [], []
    while at < len(came):
        for put, take in turns:
            numbers = unwrap(raw[at : at + put])
            at += put
            block = check(Block("s", 10 * numbers, np.stack([numbers, numbers], 1), sequence=numbers))
            if block is not None:
                passed += block.sequence.tolist()
                queue.put(block)
            block = queue.take(take)
            taken += [] if block is None else [block]
        if not any(put for put, _ in turns):
            break
    left = queue.rows
    queue.discard()
    written = [number for block in taken for number in block.sequence.tolist()]
    assert check.received == min(at, len(came)) == len(written) + queue.dropped + check.duplicates + check.late
    assert queue.dropped >= left
    assert queue.rows == 0
    missing = sorted(set(passed) - set(written))
    assert len(missing) == queue.dropped
    marked = [
        number
        for block in taken
        if block.quality is not None
        for number, marks in zip(block.sequence.tolist(), block.quality, strict=True)
        if (marks & Quality.GAP).all()
    ]
    # Marked are the rows after those that never came, and after those that were dropped here.
    assert [number for number in marked if number != written[0]] == [b for a, b in pairwise(written) if b > a + 1]
    for block in taken:
        assert np.array_equal(block.data, np.stack([block.sequence] * 2, 1))
        assert np.array_equal(block.t_ns, 10 * block.sequence)


def test_a_full_queue_drops_the_newest_block_and_marks_the_next_row():
    queue = BlockQueue(STREAM, 0.1)
    for first in (0, 4, 8):
        queue.put(rows_of(first, 4))
    assert queue.dropped == 4
    assert queue.take(3).sequence.tolist() == [0, 1, 2]
    queue.put(rows_of(12, 4, quality=np.full((4, 2), Quality.SUSPECT, dtype=np.uint8)))
    assert queue.rows == 9
    assert queue.take(5).quality is None
    last = queue.take(100)
    assert last.sequence.tolist() == [12, 13, 14, 15]
    assert last.quality[:, 0].tolist() == [Quality.SUSPECT | Quality.GAP, *[Quality.SUSPECT] * 3]
    assert queue.take(100) is None


def test_rows_without_numbers_times_or_marks():
    queue = BlockQueue(STREAM, 0.1)
    queue.put(Block("s", None, np.ones((11, 2))))
    queue.put(Block("s", None, np.ones((2, 2))))
    block = queue.take(5)
    assert (block.t_ns, block.sequence, block.device_ns) == (None, None, None)
    assert block.quality.tolist() == [[Quality.GAP] * 2, [0, 0]]
    assert queue.dropped == 11


def test_a_stream_without_a_rate_is_bounded_by_bytes():
    queue = BlockQueue(STREAM.model_copy(update={"rate_hz": None}), 5.0)
    block = Block("s", None, np.zeros((100_000, 2), dtype=np.int16))
    for _ in range(100):
        queue.put(block)
    assert queue.rows * (4 + 2) <= MOST_BYTES
    assert queue.rows + queue.dropped == 10_000_000
    assert queue.dropped > 0


@pytest.mark.parametrize(
    "other",
    [
        Block("s", np.arange(2), np.zeros((2, 2), dtype=np.int16)),
        Block("s", np.arange(2), np.zeros((2, 3), dtype=np.int16), sequence=np.arange(2)),
        Block("s", np.arange(2), np.zeros((2, 2)), sequence=np.arange(2)),
        Block("s", np.arange(3), np.zeros((2, 2), dtype=np.int16), sequence=np.arange(2)),
    ],
    ids=["no numbers", "three channels", "floats", "three times"],
)
def test_a_block_that_does_not_fit_the_first_is_refused(other):
    queue = BlockQueue(STREAM, 5.0)
    queue.put(rows_of(0, 2))
    with pytest.raises(RigError, match="'s'"):
        queue.put(other)
