"""The log of an item: its end is kept, whoever writes and reads while it is cut back."""

import os

import pytest

from tactbench.core.pool.log import LOG_BYTES, OVERFLOW_BYTES, cut_back, open_log, tail


@pytest.fixture
def log():
    made = open_log()
    yield made
    os.close(made)


def test_a_log_that_is_cut_back_never_lacks_its_end(log):
    os.write(log, b"x" * (OVERFLOW_BYTES + LOG_BYTES) + b"the end\n")
    whole, end = os.fstat(log).st_size, tail(log)
    cut_back(log)
    # Its length stays: at no moment was there less to read for a process that was just then looking.
    assert os.fstat(log).st_size == whole
    assert tail(log) == end
    assert 512 * os.fstat(log).st_blocks <= OVERFLOW_BYTES / 2, "and the memory is given back"
    os.write(log, b"more")
    assert tail(log) == end[4:] + "more"


def test_a_short_log_is_left_alone(log):
    os.write(log, b"x" * (OVERFLOW_BYTES // 2))
    cut_back(log)
    assert os.pread(log, 2, 0) == b"xx"
