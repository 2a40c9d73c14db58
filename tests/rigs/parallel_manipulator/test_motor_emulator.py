"""The emulated drive: answers of the vectors, pace of the line, motion within its limits, faults by name."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.rigs.parallel_manipulator.motor.codec import (
    OVERTEMPERATURE,
    Kind,
    Line,
    LineReader,
    OperationStatus,
    encode,
    line_time_s,
)
from tactbench.rigs.parallel_manipulator.motor.emulator import MotorEmulator, MotorFault
from tactbench.rigs.parallel_manipulator.motor.servo import MotorModel, Profile, Servo
from tests.rigs.parallel_manipulator.test_motor_codec import ANSWERED_OK

STEP_M = 6e-6


def nothing(position_m, time_s):
    return 0.0


def wall(at_m, stiffness):
    """Return a spring [N/m] that begins at a position."""
    return lambda position_m, time_s: stiffness * max(0.0, position_m - at_m)


def joined_bytes(sent):
    return b"".join(piece for _, piece in sent)


class Host:
    """Asks on a clock of its own; what it reads is split by the codec."""

    def __init__(self, load=nothing, **more):
        self.emulator = MotorEmulator(load, np.random.default_rng(15), **more)
        self.reader = LineReader()
        self.now_s = 0.0

    def wait(self, seconds):
        self.now_s += seconds
        return self.reader.feed(joined_bytes(self.emulator.poll(self.now_s)))

    def lines(self, text, seconds=0.1):
        """Send raw text and return all lines of some time: the line needs 36 ms for its longest answer at 9600."""
        sent = self.emulator.feed(text.encode(), self.now_s)
        return self.reader.feed(joined_bytes(sent)) + self.wait(seconds)

    def ask(self, text):
        """Return the text of the one answer."""
        (line,) = [line for line in self.lines(text + "\r") if line.kind is not Kind.NOTICE]
        return line.text

    def do(self, *texts):
        for text in texts:
            assert self.ask(text) == "OK", text

    def go(self, target_m, seconds):
        """Move to a position and return the notices of the time it is given."""
        self.do(f"LA{round(target_m / STEP_M)}", "NP")
        return [line.text for line in self.lines("M\r", seconds) if line.kind is Kind.NOTICE]

    @property
    def status(self):
        return OperationStatus(int(self.ask("OST")))


@pytest.mark.parametrize(
    ("text", "sent", "command"), ANSWERED_OK, ids=[f"FH-1.{i + 1}-{row[0]}" for i, row in enumerate(ANSWERED_OK)]
)
def test_ok(text, sent, command):
    host = Host()
    host.do("EN")
    if command.node is not None:
        host.do(f"NODEADR{command.node}")
    assert host.lines(bytes.fromhex(sent).decode())[0] == Line(Kind.OK, "OK")


@pytest.mark.parametrize(
    ("before", "asked", "answer"),
    [
        (["HO98956"], "POS", "98956"),
        (["HO-1500"], "POS", "-1500"),
        (["NODEADR2"], "2POS", "0"),
        (["HO98956"], "pos", "98956"),
        (["EN"], "OST", "65536"),
        (["EN"], "GST", "1001100"),
        (["EN", "APL1"], "CST", "9220"),
        ([], "XYZ", "Unknown command"),
        ([], "LPC-5", "Invalid parameter"),
        ([], "GOHOSEQ", "Command not available"),
        ([], "SAVE", "EEPROM writing done"),
    ],
    ids=[
        "FH-2.1",
        "FH-2.2",
        "FH-2.3",
        "FH-2.4",
        "FH-2.10",
        "FH-2.14",
        "FH-2.16",
        "FH-2.17",
        "FH-2.18",
        "FH-2.19",
        "FH-2.21",
    ],
)
def test_answers_of_the_vectors(before, asked, answer):
    host = Host()
    host.do(*before)
    assert host.ask(asked) == answer


def test_silence_and_changed_rate():
    """FH-2.23 and FH-2.24."""
    host = Host()
    host.lines("ANSW0\r")
    assert host.lines("LA1000\r") == []
    assert host.lines("XYZ\r") == []
    assert host.ask("POS") == "0"
    host.lines("ANSW2\r")
    assert host.lines("BAUD19200\r") == []
    sent_s = host.now_s
    host.emulator.feed(b"POS\r", sent_s)
    # 4 bytes, the drive's time of 1 ms, 3 bytes; half a bit of room on either side.
    due_s = sent_s + line_time_s(4, 19200) + 1e-3 + line_time_s(3, 19200)
    assert joined_bytes(host.emulator.poll(due_s - 25e-6)) == b"0"
    assert host.emulator.poll(due_s + 25e-6) == [(pytest.approx(due_s), b"\r\n")]


@pytest.mark.parametrize("ticks", [1, 7, 1000])
def test_a_drive_that_stands_without_load_answers_as_if_each_tick_were_made(ticks):
    """Ticks are left out where nothing moves: whether it is looked at between them changes nothing."""
    made = {}
    for skipped in (False, True):
        host = Host(load=None if skipped else lambda _position_m, _at_s: 0.0)
        for text in ("EN", "LA500", "M"):
            host.do(text)
        host.wait(1.0)
        assert host.emulator.drive.standing == skipped
        host.wait(ticks * 1e-3)
        host.do("LR-20")
        host.do("M")
        host.wait(0.013)
        servo = host.emulator.drive.servo
        made[skipped] = (host.ask("POS"), host.ask("OST"), servo.position_m, host.emulator._ticks)
    assert made[True][:2] == made[False][:2]
    # Positions to what a tick resolves, 1 nm/s for 1 ms and its decay over a second.
    assert made[True][2] == pytest.approx(made[False][2], abs=2e-9)
    assert made[True][3] == made[False][3]


def test_a_move_ends_on_its_target_and_says_so():
    host = Host()
    host.do("EN")
    assert host.go(3e-3, 0.6) == ["p"]
    assert host.ask("POS") == "500"
    assert host.ask("TPOS") == "500"
    assert host.status & OperationStatus.POSITION_ATTAINED
    assert host.ask("GST")[4] == "1"
    # Relative steps add up exactly.
    for _ in range(5):
        host.do("LR-7", "M")
    host.wait(0.3)
    assert host.ask("POS") == str(500 - 35)


def test_the_servo_goes_its_lag_and_is_stable_against_any_spring():
    servo = Servo(MotorModel(), None)
    reference = Profile(1e-3)
    for n in range(1, 20):
        servo.step(1e-3 * n, reference, 1.6)
        assert servo.position_m == pytest.approx(1e-3 * (1 - math.exp(-n / 5)), rel=1e-12)
    stiff = Servo(MotorModel(), lambda position_m, _: 1e9 * max(0.0, position_m))
    for n in range(100):
        stiff.step(1e-3 * n, reference, 1.6)
    # It stands where the spring is as strong as the current limit, 10.4 N.
    assert stiff.position_m == pytest.approx(10.4e-9, rel=1e-6)
    assert (stiff.limited, stiff.current_a) == (True, 1.6)


def test_the_current_limit_bounds_the_force_and_is_said():
    host = Host(wall(0.0, 80e3))
    host.do("EN", "LPC400", "LCC400")
    assert host.go(2e-3, 1.0) == []
    assert host.ask("GRC") == "400"
    assert host.emulator.drive.servo.position_m == pytest.approx(0.4 * 6.5 / 80e3, rel=1e-3)
    assert host.ask("GFS") == "0100"
    status = host.status
    assert status & OperationStatus.CURRENT_LIMITATION
    assert not status & OperationStatus.POSITION_ATTAINED


@pytest.mark.parametrize("text", ["POR8", "GU", "SWS", "SOR1"])
def test_what_is_not_modelled_is_not_pretended(text):
    assert Host().ask(text) == "Command not available"


def test_a_motor_fault_takes_the_power_and_says_so():
    host = Host(faults=[MotorFault("motor-fault", 0.5, 2.0)])
    host.do("EN", "V10")
    assert host.wait(0.5) == [Line(Kind.NOTICE, "f")]
    assert host.status & OperationStatus.OVERTEMPERATURE
    assert host.ask("EN") == OVERTEMPERATURE  # FH-2.20
    assert host.ask("V10") == OVERTEMPERATURE
    host.wait(1.5)
    assert host.ask("GN") == "0"  # Without power it has run out.
    assert host.ask("GST")[3] == "0"  # The end of the fault alone does not move it.
    host.do("EN")


@given(st.lists(st.binary(max_size=30), max_size=8))
@settings(max_examples=30)
def test_the_drive_survives_any_bytes(pieces):
    emulator, now_s = MotorEmulator(nothing, np.random.default_rng(0)), 0.0
    for piece in pieces:
        emulator.feed(piece, now_s)
        now_s += 0.02
    emulator.feed(b"\rANSW2\r", now_s)
    # What stood in the line may still be answered; then the position is.
    now_s += 1.0
    emulator.poll(now_s)
    emulator.feed(encode("HO", 321) + encode("POS"), now_s)
    drive_s = now_s + line_time_s(200, emulator.drive.settings.baud)
    if emulator.drive.settings.node == 0:
        assert joined_bytes(emulator.poll(drive_s)).endswith(b"OK\r\n321\r\n")


@given(
    target=st.floats(-0.02, 0.02),
    tick=st.sampled_from([2e-4, 1e-3, 7e-3]),
    speed=st.floats(5e-3, 1.0),
    acceleration=st.floats(0.05, 50.0),
    braking=st.floats(0.05, 50.0),
)
@settings(max_examples=50)
def test_the_profile_keeps_its_limits_and_does_not_overshoot(target, tick, speed, acceleration, braking):
    profile, before = Profile(0.0), 0.0
    # The trapezoid in continuous time, at least as quick as its triangle; some ticks for its corners.
    longest_s = abs(target) / speed + speed / acceleration + speed / braking
    ticks = 0
    while profile.position_m != target and ticks < longest_s / tick + 10:
        profile.to_position(target, tick, speed, acceleration, braking)
        room = 1 + 1e-9
        assert abs(profile.speed_m_s) <= speed * room
        change = abs(profile.speed_m_s) - abs(before)
        assert change <= acceleration * tick * room + 1e-15
        assert -change <= braking * tick * room + 1e-15
        assert min(0.0, target) - 1e-12 <= profile.position_m <= max(0.0, target) + 1e-12
        before = profile.speed_m_s
        ticks += 1
    assert profile.position_m == target
    profile.to_position(target, tick, speed, acceleration, braking)
    assert (profile.position_m, profile.speed_m_s) == (target, 0.0)
