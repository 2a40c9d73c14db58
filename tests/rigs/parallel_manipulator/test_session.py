"""Axes that outlive a scene, are watched whenever they move, and keep their home."""

import re

import numpy as np
import pytest

from tactbench.devices.guard_messages import GuardRefusesError
from tactbench.plugin import RigError, load_registry
from tactbench.plugin.devices import RigFile, ScenePhysics
from tactbench.rigs.parallel_manipulator.kinematics import forward, inverse
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator
from tactbench.rigs.parallel_manipulator.session import Session
from tactbench.rigs.parallel_manipulator.settings import JOINTS
from tests.rigs.parallel_manipulator.presses import load
from tests.rigs.parallel_manipulator.spring import Pressed, SpringRig, ramp, with_joints
from tests.rigs.parallel_manipulator.test_press import RARER

FILE = RigFile.model_validate(
    with_joints(settings__places__reach_x_mm=[-15.0, 15.0], settings__places__reach_s_mm=[-15.0, 15.0], **RARER)
)
HOME_M = np.array([0.0, 0.0, -0.15])


def drives(session):
    """Return the emulated drives of motor and rails."""
    return {name: session.emulated._devices[name].emulator.drive for name in ("motor", *JOINTS)}


def true_place_m(session):
    """Return where the platform stands, whatever its drives count: they were switched on at the home place."""
    delta = session.settings.manipulator
    away = [drives(session)[name].position_m for name in JOINTS]
    return forward(delta, inverse(delta, HOME_M) + away)


class Force:
    """What is sensed where nothing is pressed but a spring behind a way of the platform's first rail."""

    def __init__(self):
        self.servo, self.from_m, self.largest_n = None, 0.0, 0.0

    def sensed(self, at_s, _position_m):
        force_n = 0.0
        if self.servo is not None:
            force_n = 20e3 * max(0.0, self.servo.position_m - self.from_m)
            self.largest_n = max(self.largest_n, force_n)
        return {"fz": force_n + 1e-3 * np.sin(1e4 * at_s)}

    def force_n(self, _position_m):
        return 0.0

    def obstacle(self, session, after_m):
        """Let the rail run into the spring after a way from where it stands."""
        self.servo = drives(session)["joint-1"]
        self.from_m = self.servo.position_m + after_m


def begun(file):
    one = Session(file.model_copy(update={"sensors": {"icub": file.sensors["icub"]}}), load_registry())
    one.emulators.press = Force()
    return one


@pytest.fixture
def session():
    one = begun(FILE)
    yield one
    one.close()


def test_the_platform_is_where_it_believes_to_be_scene_after_scene(session):
    rng = np.random.default_rng(7)
    for _ in range(5):
        xy_m = rng.uniform(-12e-3, 12e-3, 2)
        place = session.travel(tuple(xy_m))
        assert place == pytest.approx((*xy_m, -0.15), abs=20e-6)
        # Three rails, each within its corridor of 10 um.
        assert np.linalg.norm(true_place_m(session) - place) < 20e-6
    assert sum(event.text.startswith("homing") for event in session.guard.events) == 4


def test_an_operator_is_asked_what_the_session_cannot_know_and_once(session):
    asked = []
    for _ in range(2):
        session.travel((0.0, 0.0), lambda doing, text: not asked.append((doing, text)))
    clear, push, off = asked
    assert "motor, joint-1, joint-2, joint-3 is homed where it stands" in clear[1]
    assert "3 N (306 g)" in push[1]
    assert "Take hand or weight off" in off[1]
    assert session.checked.endswith("N read of a push of about 3 N")


def test_a_check_that_is_left_out_is_named():
    one = begun(RigFile.model_validate(with_joints(settings__press__check_n=None, **RARER)))
    one.travel((0.0, 0.0))
    assert one.checked.startswith("NOT CHECKED")
    one.close()


def test_a_scene_is_the_same_in_its_own_session_each_time():
    rig = ParallelManipulator(FILE, None, ScenePhysics(SpringRig(5.0)))
    icub, found = load_registry().sensors["icub"], []
    for _ in range(2):
        with rig.open(icub, ramp(0.5, 0.2, 0.6), seed=1) as acquisition:
            found.append(Pressed(acquisition))
    assert np.array_equal(found[0].force_n, found[1].force_n)
    assert rig._session is None


def test_the_zero_is_of_its_own_seconds_and_not_of_what_waited(session):
    pressed = session.emulators.press
    session.emulators.press = type("Hand", (), {"sensed": lambda self, at_s, x: {"fz": 5 + np.sin(1e4 * at_s)},
                                             "force_n": lambda self, x: 0.0})()  # fmt: skip
    session.emulated.advance(session.clock() + 200_000_000)
    session.emulators.press = pressed
    force, _ = session.measured_limits()
    # Of 300 samples a few were on their way; with the 200 that waited it would be 2 N.
    assert abs(force.zero[2]) < 0.1


def test_force_while_the_platform_moves_stops_every_rail(session):
    session.travel((0.0, 0.0))
    session.emulators.press.obstacle(session, 1e-3)
    with pytest.raises(RigError, match="stopped on its way: force while travelling"):
        session.travel((12e-3, 0.0))
    session.guard.disarm()
    # The ceiling of travel, 0.2 N, and the way of the rail at 50 mm/s in the guard's reaction and while it brakes.
    reaction_s = 8e-3 + 39 * 10 / 115200 + 10e-3
    assert 0.2 < session.emulators.press.largest_n < 0.2 + 20e3 * 0.05 * (reaction_s + 0.05 / (2 * 0.5))
    servos = [drives(session)[name] for name in JOINTS]
    before = [servo.position_m for servo in servos]
    session.emulated.advance(session.clock() + 500_000_000)
    # They hold within the corridor of their drives.
    assert [servo.position_m for servo in servos] == pytest.approx(before, abs=10e-6)


def test_force_while_a_rail_is_homed_stops_it():
    said = with_joints(**RARER)
    for name in JOINTS:
        said["devices"][name]["options"] = said["devices"][name]["options"] | {
            "homing": "end-stop", "homing_speed_m_s": 0.01, "home_m": 0.0793,
        }  # fmt: skip
    session = begun(RigFile.model_validate(said))
    try:
        session.emulators.press.obstacle(session, 2e-3)
        with pytest.raises(GuardRefusesError, match=r"joint-1 stands .* force while travelling"):
            session.travel((0.0, 0.0))
        # The ceiling, and 10 mm/s for an answer of the drive and while it brakes.
        assert 0.2 < session.emulators.press.largest_n < 0.2 + 20e3 * 0.01 * 0.04
        servo = drives(session)["joint-1"]
        session.emulated.advance(session.clock() + 100_000_000)
        here_m = servo.position_m
        session.emulated.advance(session.clock() + 500_000_000)
        assert servo.position_m == pytest.approx(here_m, abs=1e-5)
        # The others were not begun.
        assert [drives(session)[name].position_m for name in JOINTS[1:]] == [0.0, 0.0]
    finally:
        session.close()


def test_no_rail_moves_unless_the_motor_is_retracted(session):
    from tactbench.plugin.devices import Beat, CommandKind

    session.travel((0.0, 0.0))
    _, limits = session.measured_limits()
    guard, report = session.guard, session.guard.arm(limits)
    guard.advance(session.clock() + 20_000_000)
    report = guard.beat(Beat(session.clock()))
    move = Beat(session.clock(), "", CommandKind.MOVE_TO, position_m=-2e-3, speed_m_s=5e-3,
                force_sequence=report.force_sequence)  # fmt: skip
    assert guard.beat(move).accepted
    travel = Beat(session.clock(), "", CommandKind.TRAVEL, targets={"joint-1": 0.07})
    refused = guard.beat(travel)
    assert not refused.accepted
    assert re.search("motor is not retracted", refused.reason)


@pytest.mark.parametrize("seed", range(2))
def test_random_faults_of_all_axes_keep_the_force_below_its_bound(seed):
    """A few of the 200 of benchmarks/axes_faults.py."""
    for outcome in load("axes_faults").schedules(3, 200 + seed):
        assert outcome.wrong == (), outcome
