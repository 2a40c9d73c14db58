"""Packets by the published package's rule, and the conformance kit."""

import pytest
from tactbench.testing import plugin_checks

from tactbench_robotiq_tsf85.driver import packet, static_taxels

STATIC = bytes.fromhex("14") + b"".join((1000 + n).to_bytes(2, "big") for n in range(28))


@pytest.mark.parametrize("check", plugin_checks("robotiq-tsf85"), ids=str)
def test_conforms(check):
    check()


def test_requests():
    assert packet(0x61) == bytes.fromhex("9A006100")
    assert packet(0x58, b"\x32") == bytes.fromhex("9A00580132")


def test_fields():
    assert static_taxels(STATIC, 1) == tuple(range(1000, 1028))
    assert static_taxels(bytes.fromhex("24012C") + STATIC, 1) == tuple(range(1000, 1028))
    assert static_taxels(STATIC, 0) is None
    assert static_taxels(STATIC[:-1], 1) is None
    assert static_taxels(b"\xf0" + STATIC, 1) is None  # an unknown field ends a packet
