"""The far end of a link by due times: its faults, and emulators that ask to be polled for ever."""

from __future__ import annotations

import math

import pytest

from tactbench.core.errors import UnknownNameError
from tactbench.devices.emulation.virtual_time import Line, split_faults
from tactbench.devices.emulator import LinkFault
from tests.devices.emulation.models import Answerer, Recorder


def carried(line, until_s):
    """Return what comes out at the host's end up to a time, polled whenever something is due."""
    out = []
    line.deliver = lambda t_s, piece: out.append((t_s, piece))
    while (due_s := line.next_s()) <= until_s:
        line.poll(due_s)
    return out


def test_a_late_link_delays_what_the_device_sends_and_keeps_its_order():
    fault = LinkFault.parse("late:delay_s=0.7,start_s=1,end_s=2")
    found = carried(Line(Recorder(period_s=0.5), faults=[fault]), 3.0)
    assert [piece[0] for _, piece in found] == list(range(6))
    assert [t_s for t_s, _ in found] == pytest.approx([0.5, 1.7, 2.2, 2.2, 2.5, 3.0])


def test_an_unplugged_link_carries_nothing_from_then_on():
    device = Answerer(after_s=0.3)
    line = Line(device, faults=[LinkFault.parse("unplug:start_s=1")])
    out = []
    line.deliver = lambda t_s, piece: out.append((t_s, piece))
    line.feed(b"a", 0.5)
    line.feed(b"b", 0.9)
    assert out == [(0.8, b"a")]
    assert carried(line, 5.0) == []
    assert line.gone
    assert line.next_s() == math.inf
    line.feed(b"c", 2.0)
    assert [piece for _, piece in device.told] == [b"a", b"b"]


def test_faults_of_the_link_are_taken_out_of_those_of_the_device():
    of_link, of_device = split_faults(["parity:every=3", "unplug:start_s=5", "late"])
    assert of_device == ("parity:every=3",)
    assert of_link == (LinkFault("unplug", start_s=5.0), LinkFault("late"))
    with pytest.raises(UnknownNameError, match="start_s"):
        split_faults(["unplug:start=5"])


def test_time_goes_on_whatever_an_emulator_answers():
    class Restless(Answerer):
        def next_s(self):
            return 0.0

    line = Line(Restless())
    seen_s = []
    for _ in range(3):
        seen_s.append(line.next_s())
        line.poll(seen_s[-1])
    assert seen_s == pytest.approx([0.0, 1e-6, 2e-6])
