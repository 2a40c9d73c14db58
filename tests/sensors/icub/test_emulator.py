"""A board that does what its firmware does. What each fault comes to is tested through the driver."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import UsageError
from tactbench.plugin.devices import CanFrame
from tactbench.sensors.icub.codec import (
    BoardSetup,
    SkinDecoder,
    Transmit,
    TriangleSetup,
    command_frame,
)
from tactbench.sensors.icub.emulator import BoardFault, Bus

PAIR_S = 270e-6
"""Two frames of 135 bits at 1 Mbit/s."""
LEVEL = 200.0


def bus_of(*faults, triangle=3):
    return Bus(lambda _: {f"T{n}": LEVEL - n for n in range(1, 13)}, triangle=triangle, faults=faults)


def told(bus, *commands, to=14, now_s=0.0):
    return [frame for command in commands for _, frame in bus.feed(command_frame(to, command), now_s)]


def started(bus, *, now_s=0.0):
    """As a host does it: set up the board, enable a triangle, start."""
    told(bus, BoardSetup(), TriangleSetup(3, 3), Transmit(True), now_s=now_s)
    return bus


def samples_of(bus, until_s, period_s=0.04):
    decoder = SkinDecoder(period_s)
    return [sample for _, frame in bus.poll(until_s) for sample in decoder.feed(frame)]


@given(st.lists(st.floats(0.0, 0.5), max_size=20))
@settings(max_examples=10, deadline=None)
def test_how_often_it_is_polled_changes_nothing(times):
    def fresh():
        faults = [
            BoardFault("dropped-frame", every=3),
            BoardFault("doubled-frame", half="head"),
            BoardFault("late-answer", every=5, delay_s=0.039),
        ]
        bus = Bus(lambda now_s: {"T1": 200 + 50 * math.sin(7 * now_s)}, triangle=3, faults=faults)
        told(bus, Transmit(True))
        return bus

    bus = fresh()
    assert [frame for now_s in [*sorted(times), 0.5] for frame in bus.poll(now_s)] == fresh().poll(0.5)


@given(
    st.lists(
        st.builds(
            CanFrame,
            st.one_of(st.integers(0, 0x7FF), st.sampled_from([0x20E, 0x20F])),
            st.builds(
                lambda code, rest: bytes([code]) + rest,
                st.sampled_from([0x4D, 0x50, 0x07, 0x4C, 0x4E, 0x1C]),
                st.binary(max_size=7),
            ),
        ),
        max_size=20,
    )
)
@settings(max_examples=60, deadline=None)
def test_any_commands_are_survived_and_a_host_s_start_brings_it_back(commands):
    bus = bus_of(BoardFault("no-ack", channels=frozenset({"T7"})))
    for number, frame in enumerate(commands):
        bus.feed(frame, 0.01 * number)
    told(bus, Transmit(False), now_s=1.0)
    bus.poll(2.0)
    bus.faults.clear()
    started(bus, now_s=2.0)
    (sample,) = samples_of(bus, 2.05)
    assert sample.taxels == bytes(range(199, 187, -1))


def test_what_cannot_be_is_refused():
    for wrong in (
        lambda: BoardFault("unheard-of"),
        lambda: BoardFault("stuck-taxel", channels=frozenset({"T13"})),
    ):
        with pytest.raises(UsageError):
            wrong()
