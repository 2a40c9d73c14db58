"""The queue between reading and writing: nothing is lost uncounted, and what is lost is marked where it is missing."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.samples import Block, Quality
from tactbench.devices import reading
from tactbench.devices.reading import StreamQueue
from tactbench.plugin import RigError
from tests.devices.numbered import stream_of

STREAM = stream_of("s", 100.0, 2)


def queue_of(monkeypatch, seconds: float) -> StreamQueue:
    monkeypatch.setattr(reading, "QUEUE_S", seconds)
    return StreamQueue("device", STREAM)


def rows_of(first: int, n: int, **more) -> Block:
    numbers = np.arange(first, first + n)
    return Block("s", 10 * numbers, np.stack([numbers, -numbers], 1).astype(np.int16), sequence=numbers, **more)


def test_a_full_queue_drops_the_newest_block_and_marks_the_next_row(monkeypatch):
    queue = queue_of(monkeypatch, 0.1)
    for first in (0, 4, 8):
        queue.put(rows_of(first, 4), 1)
    assert queue.dropped == 4
    (first,) = queue.take()
    assert (first.sequence.tolist(), first.quality) == (list(range(8)), None)
    queue.put(rows_of(12, 4, quality=np.full((4, 2), Quality.SUSPECT, dtype=np.uint8)), 1)
    (last,) = queue.take()
    assert last.quality[:, 0].tolist() == [Quality.SUSPECT | Quality.GAP, *[Quality.SUSPECT] * 3]
    assert list(queue.take()) == []


@pytest.mark.parametrize(
    "other",
    [
        Block("s", np.arange(2), np.zeros((2, 2), dtype=np.int16)),
        Block("s", np.arange(2), np.zeros((2, 3), dtype=np.int16), sequence=np.arange(2, 4)),
        Block("s", np.arange(3), np.zeros((2, 2), dtype=np.int16), sequence=np.arange(2, 4)),
    ],
    ids=["no numbers", "three channels", "three times"],
)
def test_a_block_that_does_not_fit_the_first_is_refused(other, monkeypatch):
    queue = queue_of(monkeypatch, 5.0)
    queue.put(rows_of(0, 2), 1)
    with pytest.raises(RigError, match="'s'"):
        queue.put(other, 2)
