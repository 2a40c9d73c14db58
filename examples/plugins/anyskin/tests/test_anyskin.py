"""The frames of the published reader, and the conformance kit."""

import struct

import numpy as np
import pytest
from tactbench.testing import plugin_checks

from tactbench_anyskin.driver import FLOATS, SIZE, decode, encode

# 8.0024538 begins with the bytes 0D 0A: a terminator inside a frame.
TRAP = struct.unpack("<f", bytes.fromhex("0D0A0041"))[0]


@pytest.mark.parametrize("check", plugin_checks("anyskin"), ids=str)
def test_conforms(check):
    check()


def test_a_frame_is_twenty_floats_and_a_line_end():
    first = encode([25.5, -100.25, 50.125, 812.75, *[0.0] * 16])
    assert len(first) == SIZE == 82
    assert first[:16] == bytes.fromhex("0000CC41 0080C8C2 00804842 00304B44")
    assert first[-2:] == b"\r\n"


@pytest.mark.parametrize("lost", [0, 1, 7, 81])
def test_it_gets_into_step_after_any_beginning(lost):
    rows = np.arange(10)[:, None] + np.full(FLOATS, TRAP, dtype=np.float32)
    found, rest, skipped = decode(b"".join(map(encode, rows))[lost:])
    assert len(found) == (10 if lost == 0 else 9)
    np.testing.assert_array_equal(found[-1], rows[-1].astype(np.float32))
    assert (rest, skipped) == (b"", (-lost) % SIZE)
