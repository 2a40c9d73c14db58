"""The stage on its emulated controller: homed, moved, stopped, and pressing under force in the rig."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from tactbench.plugin import ForceRamp, RigContext, RigError, Scene, assumed, load_object, load_registry
from tactbench.plugin.devices import (
    DriverSettings,
    EmulatedDevice,
    EmulatedDevices,
    EmulatorSettings,
    NotReadyError,
    PositionerError,
    PositionerSilentError,
    RigFile,
)
from tactbench.testing import plugin_checks

from tactbench_gcode_stage.driver import GcodeStage
from tactbench_gcode_stage.emulator import GrblEmulator

SILENT_S = 0.5  # a controller may take so long for an answer
OPTIONS = {
    "home_m": -3e-3, "lower_m": -4e-3, "upper_m": 5e-3, "speed_m_s": 5e-3, "acceleration_m_s2": 1.0, "corridor_m": 2e-6,
    "retreat_m": -3e-3, "retreat_speed_m_s": 20e-3,
}  # fmt: skip


@pytest.mark.parametrize("check", plugin_checks("gcode-stage"), ids=str)
def test_conforms(check):
    check()


@pytest.fixture
def stage():
    emulator = GrblEmulator(EmulatorSettings(lambda t_s: {}, np.random.default_rng(1), OPTIONS))
    devices = EmulatedDevices({"stage": EmulatedDevice("bytes", emulator)})
    settings = DriverSettings(devices.opener("stage"), options=OPTIONS, clock=devices.clock)
    with devices, GcodeStage(settings) as one:
        one.emulator = emulator
        yield one


def done(stage):
    while stage.moving:
        stage.update(0.01)


def test_it_is_homed_and_goes_where_it_is_sent(stage):
    assert not stage.find_home()
    with pytest.raises(NotReadyError, match="not homed"):
        stage.move_to(0.0)
    stage.start()
    stage.home()
    # The controller has said nothing for longer than an answer may take.
    assert stage.clock() > 2e9 * SILENT_S
    assert stage.emulator.position_m == pytest.approx(-3e-3, abs=1e-9)
    stage.move_to(1.2345e-3)
    done(stage)
    assert stage.emulator.position_m == pytest.approx(1.234e-3, abs=1e-6)
    assert stage.at(1.2345e-3)
    stage.move_by(-1e-3)
    done(stage)
    assert stage.emulator.position_m == pytest.approx(0.2345e-3, abs=2e-6)
    with pytest.raises(NotReadyError, match="beyond the ends"):
        stage.move_to(6e-3)


def test_homing_is_ended_by_a_stop_and_has_a_deadline(stage):
    stage.start()
    with pytest.raises(PositionerError, match="halted"):
        stage.home(lambda: True)
    assert not stage.homed
    stage.emulator.deaf_to = b"H"
    with pytest.raises(PositionerError, match="error:5|not reached its home"):
        stage.home()
    assert not stage.homed


def test_a_halt_ends_a_move_and_a_retreat_goes_out(stage):
    stage.home()
    for leave in (stage.halt, stage.retreat):
        stage.move_to(4e-3)
        while stage.position < 1e-3:
            stage.update(0.01)
        leave()
        done(stage)
    assert stage.at(-3e-3)


def test_a_halt_that_is_lost_is_sent_again_and_then_a_reset(stage):
    stage.home()
    stage.move_to(4e-3)
    while stage.position < 0.0:
        stage.read(0.01)
    stage.emulator.deaf_to = b"\x85"
    stage.halt()
    from_m = stage.position
    with pytest.raises(PositionerError, match="Grbl|place is not known"):
        while stage.moving:
            stage.read(0.01)
    # Two halts, each after the latency and the time of braking at 5 mm/s, and a look of 10 ms.
    assert stage.emulator.position_m - from_m < 5e-3 * (2 * (0.03 + 5e-3 + 0.01) + 0.02)
    assert not stage.homed
    at_m = stage.emulator.position_m
    stage.read(0.5)
    assert stage.emulator.position_m == at_m


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"13": "1"}, "mm"),
        ({"22": "0"}, "homing"),
        ({"20": "0"}, "soft limits"),
        ({"10": "0"}, "WPos.*MPos is expected"),
    ],
)
def test_a_controller_that_is_set_up_otherwise_is_refused(stage, settings, message):
    stage.emulator.settings |= settings
    with pytest.raises(PositionerError, match=message):
        stage.start()
        stage.read(0.1)


@pytest.mark.parametrize("state", ["Alarm", "Hold:0", "Door:1", "Sleep"])
def test_a_state_in_which_it_does_not_move_takes_the_home_away(stage, state):
    stage.home()
    stage.emulator._state = state
    with pytest.raises(PositionerError, match=state):
        stage.read(0.1)
    assert not stage.homed
    with pytest.raises(NotReadyError, match="not homed"):
        stage.move_to(0.0)


@pytest.mark.parametrize("state", ["Alarm", "Idle"])
def test_a_controller_that_starts_anew_has_no_place(stage, state):
    stage.home()
    stage.move_to(1e-3)
    done(stage)
    stage.emulator.restart(state)
    with pytest.raises(PositionerError, match="Grbl"):
        stage.read(0.1)
    assert not stage.homed


def test_a_place_that_jumps_is_not_believed(stage):
    stage.home()
    for _ in range(3):
        stage.read(0.01)
    stage.emulator._at_mm = stage.emulator._to_mm = -3.0
    with pytest.raises(PositionerError, match="faster than it can move"):
        for _ in range(3):
            stage.read(0.01)
    assert not stage.homed


def test_a_move_that_does_not_arrive_ends_in_its_time(stage):
    stage.home()
    stage.emulator.settings["13"] = "1"  # it tells inches from now on
    stage.move_to(-2.9e-3)
    with pytest.raises(PositionerError, match="not reached|faster than it can move"):
        while stage.moving:
            stage.read(0.01)


def test_a_driver_that_does_not_tell_the_speed_has_its_time_too(stage, monkeypatch):
    begin = GcodeStage.begin
    monkeypatch.setattr(GcodeStage, "begin", lambda self, target=math.nan, speed=None: begin(self, target))
    stage.home()
    for speed_m_s in (0.5e-3, 20e-3):  # the axis states 5 mm/s, and 20 mm/s for a retreat
        stage.move_to(-2e-3 if speed_m_s < 1e-3 else 4e-3, speed_m_s)
        while stage.moving:
            stage.read(0.01)
    assert stage.at(4e-3)


def test_a_refusal_and_silence_are_named(stage):
    stage.homed = stage.enabled = True
    stage.move_to(0.0)
    with pytest.raises(PositionerError, match="error:9|Alarm"):
        done(stage)
    stage.home()
    stage.emulator.feed = lambda piece, now_s: []
    with pytest.raises(PositionerSilentError):
        for _ in range(100):
            stage.update(0.1)


PROFILE = ForceRamp(hold=assumed(1.0, "s", "a test"), duration=assumed(12.0, "s", "a test"))


def opened():
    """Open a press by the rig file; its surface is found then."""
    said = yaml.safe_load((Path(__file__).parents[1] / "rig.yaml").read_text(encoding="utf-8"))
    said["settings"]["touch"]["settle_s"] = 2.0
    registry = load_registry()
    rig = load_object(registry.rigs["parallel-manipulator"].where)(RigContext(rig_file=RigFile.model_validate(said)))
    return rig.open(registry.sensors["icub"], Scene(name="press", profile=PROFILE), seed=1)


def test_it_presses_under_force_in_the_rig():
    with opened() as acquisition:
        force_n = np.concatenate([block.data[:, 2] for block in acquisition if block.stream == "force_torque"])
    assert acquisition.ended == ""
    # 5 N less what the ramp of 0.45 N/s is behind at a gain of 0.3 mm/(N s), and the noise of 0.69 N.
    assert force_n[-250:].mean() == pytest.approx(5.0, abs=0.6)


def test_a_press_whose_halts_are_lost_stands_soon(monkeypatch):
    feed, places = GrblEmulator.feed, []

    def deaf(emulator, piece, now_s):
        """Lose the halt of the touch, and all later ones."""
        if places or (b"\x85" in piece and emulator.position_m > -2e-3):
            emulator.deaf_to = b"\x85"
            places.append(emulator.position_m)
        return feed(emulator, piece, now_s)

    monkeypatch.setattr(GrblEmulator, "feed", deaf)
    with pytest.raises(RigError, match="The surface was not found"), opened():
        pass
    # 0.5 mm/s for two halts, each with its latency and time of braking, and answers of some milliseconds.
    assert 0 < max(places) - places[0] < 0.5e-3 * (2 * (0.03 + 5e-3) + 0.02)
