"""The motor's driver against its emulator: answers apart from notices, moves, homing, retreats, and what goes wrong."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality
from tactbench.plugin.devices import (
    DriverSettings,
    EmulatorSettings,
    NotReadyError,
    PositionerError,
    PositionerSilentError,
)
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver
from tactbench.rigs.parallel_manipulator.motor.emulator import MotorEmulator, MotorFault
from tactbench.rigs.parallel_manipulator.motor.exchange import IN_A_ROW, MotorRefusalError
from tests.rigs.parallel_manipulator.pumps import VirtualLink

STEP_M = 6e-6
LIMITS = {"lower_m": -9e-3, "upper_m": 9e-3, "speed_m_s": 0.05, "acceleration_m_s2": 1.0, "corridor_m": 12e-6}


def wall(at_m, stiffness):
    """Return a spring [N/m] that begins at a position."""
    return lambda position_m: stiffness * max(0.0, position_m - at_m)


def motor(load=None, faults=()):
    made = MotorEmulator(EmulatorSettings(lambda at_s: {}, np.random.default_rng(15)))
    made.press_against(load)
    made.faults = list(faults)
    return made


def driver_on(emulator, **options):
    link = VirtualLink(emulator)
    return FaulhaberDriver(DriverSettings(open_link=lambda: link, options=options, clock=link.clock)), link


def ready(load=None, faults=(), **options):
    """Return a driver that is homed where it stands and has power, and its link."""
    driver, link = driver_on(motor(load, faults=faults), **(LIMITS | options))
    driver.start()
    driver.home()
    driver.enable()
    return driver, link


def finish(driver, link):
    """Carry a move on to its end."""
    driver.finish(lambda: False)


def settled(driver, link):
    """Return what is known after the next whole turn of questions."""
    driver.read(0.0)
    begin_ns = link.clock()
    while driver.state is None or driver.state.t_ns < begin_ns:
        driver.update(0.01)
    return driver.state


def place(link):
    return link.emulator.drive.position_m


# As a device of a rig -------------------------------------------------------------------------------------------------


def test_it_is_watched_without_being_moved():
    driver, link = driver_on(motor())
    driver.start()
    blocks = []
    while link.now_s < 103.0:
        blocks += driver.read(0.1)
    data = np.concatenate([block.data for block in blocks])
    t_ns = np.concatenate([block.t_ns for block in blocks])
    (stream,) = driver.streams
    assert [(c.name, c.unit) for c in stream.channels] == [("position", "m"), ("target", "m")]
    # Without power nobody knows a target.
    assert not driver.enabled
    assert (data[:, 0] == 0.0).all()
    assert np.isnan(data[:, 1]).all()
    assert all((block.quality == [[Quality.GOOD, Quality.MISSING]]).all() for block in blocks)
    assert np.diff(t_ns) == pytest.approx(20e6, abs=1e6)
    driver.stop()
    driver.close()
    driver.close()


# Homing ---------------------------------------------------------------------------------------------------------------


def test_homing_on_the_end_stop_with_little_current():
    driver, link = driver_on(motor(), **LIMITS, homing="end-stop", homing_speed_m_s=-0.02, home_m=-10e-3)
    drive, largest = link.emulator.drive, []
    driver.start()
    driver.home(lambda: largest.append(drive.settings["LPC"]))
    # The stop is beyond the ends of travel, so it has come back to them; its current is what it was.
    assert place(link) == pytest.approx(-9e-3, abs=2 * STEP_M)
    assert largest.count(200) > 2  # mA
    assert drive.settings["LPC"] == 1600
    driver.move_to(0.0)
    finish(driver, link)
    assert place(link) == pytest.approx(0.0, abs=2 * STEP_M)


@pytest.mark.parametrize(
    "stated", [{"peak_current_a": 0.8}, {"peak_force_n": 5.2, "force_constant_n_a": 6.5},
               {"peak_force_n": 5.2, "force_constant_n_a": 6.5, "peak_current_a": 1.6}],
)  # fmt: skip
def test_the_lower_limit_of_current_is_sent_and_read_back(stated):
    driver, link = driver_on(motor(), **LIMITS, **stated)
    settings = link.emulator.drive.settings
    settings.update(LPC=5000, LCC=3000)
    driver.start()
    driver.home()
    driver.confirm()
    # The continuous current is not above the peak one; one that is lower belongs to the motor and stays.
    assert (settings["LPC"], settings["LCC"]) == (800, 800)
    for name in ("LPC", "LCC"):
        settings[name] = 900
        with pytest.raises(PositionerError, match="900"):
            driver.confirm()
        settings[name] = 800
    settings["LCC"] = 300
    driver.start()
    driver.confirm()
    assert settings["LCC"] == 300


# Retreats -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("updates", range(0, 40, 5))
def test_a_retreat_takes_the_place_of_a_move_at_any_moment(updates):
    """Whichever answers are outstanding: those of the move, or of polls."""
    driver, link = ready(retreat_m=-2e-3, retreat_speed_m_s=0.2)
    driver.move_by(500 * STEP_M)
    for _ in range(updates):
        driver.update(0.002)
    begin_s = link.now_s
    driver.retreat()
    assert link.now_s == begin_s
    finish(driver, link)
    assert place(link) == pytest.approx(-2e-3, abs=STEP_M)
    assert driver.state.target == pytest.approx(-2e-3, abs=STEP_M / 2)
    assert driver.counts == {}
    # The next move has the speed of moves again.
    driver.move_by(STEP_M)
    finish(driver, link)
    assert link.emulator.drive.settings["SP"] == 50


# After a restart of the program ---------------------------------------------------------------------------------------


def restarted(link, **options):
    """Return another driver on the line of a drive that went on."""
    link._arrived.clear()
    driver = FaulhaberDriver(DriverSettings(open_link=lambda: link, options=LIMITS | options, clock=link.clock))
    driver.start()
    return driver


def test_a_drive_that_kept_its_power_knows_its_place():
    driver, link = ready()
    driver.move_to(3e-3)
    finish(driver, link)
    again = restarted(link)
    assert again.find_home()
    assert again.homed
    again.move_to(1e-3)
    finish(again, link)
    assert place(link) == pytest.approx(1e-3, abs=STEP_M)


@pytest.mark.parametrize("change", ["DI", "APL0", "LL1000"])
def test_a_drive_that_lost_something_is_homed_anew(change):
    _, link = ready()
    link.write(change.encode() + b"\r")
    link.go(0.1)
    again = restarted(link)
    assert not again.find_home()
    assert not again.homed


# What goes wrong ------------------------------------------------------------------------------------------------------


def test_an_increment_that_is_not_answered():
    driver, link = ready()
    driver.update(0.1)
    driver.move_by(100 * STEP_M)
    send = link.emulator._send
    link.emulator._send = lambda text, at_s: send(text, at_s + 0.5)
    with pytest.raises(PositionerSilentError, match="after a move"):
        finish(driver, link)
    link.emulator._send = send
    assert not driver.moving
    with pytest.raises(NotReadyError, match="target"):
        driver.move_by(STEP_M)
    found_m, _ = driver.locate()
    assert found_m == pytest.approx(place(link), abs=STEP_M)
    driver.move_by(STEP_M)
    finish(driver, link)
    link.go(0.1)
    assert settled(driver, link).position == pytest.approx(found_m + STEP_M)


def test_garbled_lines_cost_time_and_are_counted():
    driver, link = ready(retreat_m=-5e-3)
    link.emulator.faults = [MotorFault("garbled-line", every=13)]
    moved = trouble = 0
    rng = np.random.default_rng(2)
    for _ in range(40):
        while not driver.enabled:  # a damaged status may look like a fault of the drive
            with suppress(PositionerError):
                driver.enable()
        try:
            driver.move_to(rng.uniform(-8e-3, 8e-3))
            finish(driver, link)
            moved += 1
            assert place(link) == pytest.approx(link.emulator.drive.target_m, abs=STEP_M)
        except PositionerError:
            trouble += 1
            driver.retreat()
            while driver.moving:
                try:
                    finish(driver, link)
                except PositionerError:
                    driver.retreat()
            assert place(link) == pytest.approx(-5e-3, abs=STEP_M)
    counts = driver.counts
    assert moved + trouble == 40
    assert moved > 10
    # What was garbled was missed, and each move that failed has missed something.
    assert counts["garbled"] > 0
    assert counts["time_outs"] >= trouble > 0


def test_a_motor_fault_takes_the_power_and_is_a_problem_until_it_is_over():
    driver, link = ready(faults=[MotorFault("motor-fault", 103.0, 104.0)])
    driver.move_to(8e-3)
    finish(driver, link)
    while driver.enabled:
        driver.read(1.0)
    assert link.now_s == pytest.approx(103.0, abs=0.1)
    assert "overtemperature" in settled(driver, link).problem
    with pytest.raises(MotorRefusalError, match="Overtemperature"):
        driver.enable()
    with pytest.raises(NotReadyError):
        driver.move_to(0.0)
    while link.now_s < 105.0:
        driver.read(0.1)
    driver.enable()
    assert settled(driver, link).problem == ""
    driver.move_to(0.0)
    finish(driver, link)
    assert driver.counts == {"refusals": 1}


def test_a_wall_is_a_move_that_does_not_end():
    driver, link = ready(wall(1e-3, 1e6), peak_current_a=0.3, retreat_m=-2e-3)
    driver.move_to(2e-3)
    with pytest.raises(PositionerError, match=r"0\.001998"):
        finish(driver, link)
    assert driver.state.problem == "current limitation"
    driver.retreat()
    finish(driver, link)
    assert place(link) == pytest.approx(-2e-3, abs=STEP_M)


def test_another_target_than_asked_for_is_noticed():
    driver, link = ready()
    driver.move_by(100 * STEP_M)
    answer = link.emulator.drive.answer

    def damaged(command):
        """A digit turned on its way to the drive, which the protocol cannot notice."""
        return answer(command._replace(argument=900) if command.name == "LA" else command)

    link.emulator.drive.answer = damaged
    with pytest.raises(PositionerError, match=r"0\.0054 m.*0\.0006 m"):
        finish(driver, link)


@given(st.lists(st.binary(max_size=30), max_size=12), st.integers(0, 2**31))
@settings(max_examples=25)
def test_any_bytes_from_the_drive_raise_named_errors_only(pieces, seed):
    """And do not keep it from being read again."""
    driver, link = ready()
    rng = np.random.default_rng(seed)
    for piece in pieces:
        link.arrive(piece)
        link.go(rng.uniform(0, 0.05))
        with suppress(PositionerError):
            driver.read(0.05)
    link.go(0.5)
    for _ in range(IN_A_ROW + 2):
        try:
            found = driver.read(1.0)
        except PositionerError:
            found = []
        if found:
            break
    else:
        pytest.fail("it is not read again")
