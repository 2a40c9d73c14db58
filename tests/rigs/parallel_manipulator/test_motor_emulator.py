"""The emulated drive: answers of the vectors, pace of the line, motion within its limits, faults by name."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin.devices import EmulatorSettings
from tactbench.rigs.parallel_manipulator.motor.codec import line_time_s
from tactbench.rigs.parallel_manipulator.motor.emulator import Motion, MotorEmulator


def emulated(**options):
    return MotorEmulator(EmulatorSettings(lambda at_s: {}, np.random.default_rng(15), options))


def joined_bytes(sent):
    return b"".join(piece for _, piece in sent)


@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        (b"HO98956\rPOS\r", b"98956"),
        (b"HO-1500\rpos\r", b"-1500"),
        (b"EN\rOST\r", b"65536"),
        (b"EN\rAPL1\rCST\r", b"9220"),
        (b"XYZ\r", b"Unknown command"),
        (b"LPC-5\r", b"Invalid parameter"),
        (b"M\r", b"Command not available"),
    ],
)
def test_answers_of_the_vectors(sent, answer):
    emulator = emulated()
    emulator.feed(sent, 0.0)
    assert joined_bytes(emulator.poll(1.0)) == b"OK\r\n" * (sent.count(b"\r") - 1) + answer + b"\r\n"


def test_bytes_take_the_time_of_the_line():
    emulator = emulated(baud=19200)
    emulator.feed(b"POS\r", 0.0)
    # 4 bytes, the drive's time of 1 ms, 3 bytes; half a bit of room on either side.
    due_s = line_time_s(4, 19200) + 1e-3 + line_time_s(3, 19200)
    assert joined_bytes(emulator.poll(due_s - 25e-6)) == b"0"
    assert emulator.poll(due_s + 25e-6) == [(pytest.approx(due_s), b"\r\n")]


some = st.floats(5e-3, 1.0)


@given(st.floats(-0.02, 0.02), st.floats(-0.5, 0.5), some, st.floats(0.05, 50.0))
@settings(max_examples=100)
def test_a_motion_keeps_its_limits_and_ends_on_its_target(target, before, speed, rate):
    motion = Motion(0.0, 0.0, before)
    motion.to_position(target, speed, rate)
    assert motion.at(motion.end_s) == motion.at(motion.end_s + 1.0) == (target, 0.0)
    t_s = np.linspace(0.0, motion.end_s, 2000)
    place, v = np.array([motion.at(at) for at in t_s]).T
    # Place is the integral of speed, to what a trapezoid of one step hides of a corner.
    step_s = t_s[1]
    assert np.abs(np.diff(place) - 0.5 * step_s * (v[1:] + v[:-1])).max() <= rate * step_s**2 + 1e-12
    assert np.abs(np.diff(v)).max(initial=0.0) <= rate * step_s + 1e-9
    assert np.abs(v).max() <= max(speed, abs(before)) + 1e-12
    # From rest it goes straight there.
    if before == 0.0:
        assert min(0.0, target) - 1e-12 <= place.min() <= place.max() <= max(0.0, target) + 1e-12
