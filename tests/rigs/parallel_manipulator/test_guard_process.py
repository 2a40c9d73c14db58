"""Rig and guard that are killed or hang, and what stands in their logs; the line of a motor with nobody at it."""

import json
import re
import signal
import threading
from pathlib import Path

import pytest

from tactbench.core.errors import UnknownNameError
from tactbench.devices.guard_messages import Trigger
from tactbench.plugin.devices import (
    Beat,
    DeviceSettings,
    DriverSettings,
    GuardLostError,
    GuardProcess,
    GuardState,
    PositionerError,
    ProcessSettings,
)
from tactbench.rigs.parallel_manipulator.motor.codec import Command
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver, retreat_command
from tests.rigs.parallel_manipulator.presses import FAULTS, PATIENT, load, rig

KILLS = load("guard_kills")
ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("name", "baud"),
    [
        ("kill rig, a sibling alive", 9600),
        ("stop rig", 115200),
        ("kill guard", 9600),
        ("stop guard", 115200),
        ("kill both", 115200),
        ("terminate guard", 115200),
    ],
)
def test_who_is_left_lets_the_motor_retreat(name, baud):
    # A press that a busy machine has ended before the signal says nothing.
    result = next(filter(None, (KILLS.run(name, baud, seed, PATIENT["heartbeat_s"]) for seed in range(1, 5))))
    # At most the increment that was accepted goes on, and the swing of the motor about its target.
    assert result.moved_m <= 1.5 * result.step_m
    if name == "kill both":
        assert not result.out
        return
    # The exact bound is that of benchmarks/guard_kills.py: this machine may be busy.
    assert result.late_s <= result.allowed_s + result.host_late_s + 1.0
    assert result.out
    triggers = [entry["trigger"] for entry in result.log if entry.get("trigger")]
    expected = {
        "kill rig, a sibling alive": [Trigger.RIG_LOST],
        "stop rig": [Trigger.BEAT_OLD],
        "terminate guard": [Trigger.TERMINATED],
    }.get(name, [])
    assert triggers == expected
    if name in ("kill guard", "stop guard"):
        (lost,) = [line["lost"] for line in result.said if "lost" in line]
        where = re.search(r"to (\S+) m,", lost)
        # The drive's corridor, or two increments: within it a retreat has arrived.
        assert float(where[1]) == pytest.approx(FAULTS.RETREAT_M, abs=1.01 * FAULTS.STATED["corridor_m"])
    else:
        assert "left" in result.log[-1]


def test_a_guard_that_is_lost_says_so_ever_after(tmp_path):
    with rig("process", tmp_path) as made:
        made.guard.arm(made.setting.limits)
        made.guard._process.send_signal(signal.SIGINT)
        made.guard._process.send_signal(signal.SIGHUP)
        assert made.guard.beat(Beat(made.clock())).accepted
        made.guard._process.kill()
        for _ in range(2):
            with pytest.raises(GuardLostError):
                made.guard.advance(made.clock() + 10**9)
        (event,) = [event for event in made.guard.events if event.trigger]
        assert event.trigger == "guard is gone"
        assert made.out


def test_what_a_driver_refuses_is_raised_here_as_it_was_there(tmp_path):
    motor = DeviceSettings(f"{FaulhaberDriver.__module__}:FaulhaberDriver", "loop://?baud=9600", {"sped": 1})
    guard = GuardProcess(ProcessSettings({"motor": motor}, motor, str(tmp_path / "log")))
    with pytest.raises(UnknownNameError, match="sped") as refused:
        guard.start()
    assert "speed_m_s" in refused.value.hint
    guard.close()


# The end stop is 5 mm behind the skin.
TO_A_STOP = {"homing": "end-stop", "homing_speed_m_s": 5e-3, "home_m": 5e-3}


def test_a_guard_that_is_killed_while_homing_leaves_a_motor_that_stands(tmp_path, monkeypatch):
    monkeypatch.setattr(FAULTS, "STATED", FAULTS.STATED | TO_A_STOP)
    with rig("process", tmp_path) as made:
        killed = []

        def kill(wrench, at_s):
            if made.world.position_m > FAULTS.RETREAT_M + 1e-3 and not killed:
                killed.append(at_s)
                made.guard._process.kill()
            return wrench

        made.world.sensed = kill
        with pytest.raises(GuardLostError):
            made.guard.arm(made.setting.limits)
        waits = threading.Event()
        for _ in range(15):  # two moments a fifth of a second apart, within three seconds
            before_m = made.world.position_m
            if not waits.wait(0.2) and abs(made.world.position_m - before_m) < 1e-6:
                break
        else:
            pytest.fail("the motor moves on")
        assert b"".join(piece for _, piece in made.world.motor.told).endswith(b"\rV0\r")
        # 5 mm/s for the second that a busy machine may take at most.
        assert made.world.position_m < FAULTS.RETREAT_M + 6e-3
        assert made.world.force_n == 0.0


def test_a_force_that_is_not_a_number_and_the_log_says_when_and_what(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    with rig("process", tmp_path, force_driver="tests.rigs.parallel_manipulator.broken_force:NanDriver") as made:
        made.press()
        report = made.ended()
        assert (report.state, report.trigger) == (GuardState.FAULT, Trigger.FORCE_NOT_A_NUMBER)
        assert made.out
        assert made.world.largest_n < 2.0
    lines = made.log.read_text(encoding="utf-8").splitlines()
    found = [json.loads(line) for line in lines if line.startswith("{")]
    assert found[0].keys() == {"started", "unix_ns", "pid"}
    states = [entry["state"] for entry in found if "text" in entry]
    assert states == ["idle", "idle", "armed", "retreating", "fault", "idle"]


# The line with nobody at it -------------------------------------------------------------------------------------------


def nobody_at(world):
    """Return a driver of the motor as another process opens it."""
    options = world.settings()["motor"]
    return FaulhaberDriver(DriverSettings(world.devices.opener("motor"), options=options, clock=world.clock))


@pytest.mark.parametrize("half", [b"", b"LA12", b"TPOS\r", b"POS\rOST\r"])
def test_a_blind_halt_and_a_blind_retreat_whatever_stands_on_the_line(half):
    setting = FAULTS.Setting(baud=9600)
    world = FAULTS.Pressed(setting)
    guard = world.guard()
    guard.start()
    FAULTS.Press(guard, setting, world.clock).run(2.5)
    assert world.position_m > -1e-3
    guard._press.close()
    for within_s in (None, 2.0):
        with world.devices.open_link("motor") as link:
            link.write(b"V-5\r")
            world.devices.advance(world.clock() + 10**8)
            link.write(half)
        assert world.motor.drive.answer(Command("GN")) == "-5"
        with nobody_at(world) as motor:
            position_m = motor.rescue(within_s)
        world.devices.advance(world.clock() + 10**8)
        where_m = world.position_m
        world.devices.advance(world.clock() + 10**9)
        assert world.position_m == pytest.approx(where_m, abs=1e-6)
        assert world.motor.drive.enabled
    assert position_m == pytest.approx(FAULTS.RETREAT_M, abs=5e-6)
    assert world.position_m == pytest.approx(FAULTS.RETREAT_M, abs=20e-6)


def test_a_blind_retreat_that_ends_elsewhere_says_where():
    world = FAULTS.Pressed(FAULTS.Setting())
    # Never switched on: it answers, and stays.
    with nobody_at(world) as motor, pytest.raises(PositionerError, match=r"0\.5 s.* 0 m"):
        motor.rescue(0.5)
    assert retreat_command(motor.options) == b"SP50\rLA-5000\rM\r"
