"""Axes that outlive a scene, are watched whenever they move, and keep their home."""

import numpy as np
import pytest

from tactbench.plugin import RigError, load_registry
from tactbench.plugin.devices import Beat, CommandKind, RigFile, ScenePhysics
from tactbench.rigs.parallel_manipulator.kinematics import forward
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator
from tactbench.rigs.parallel_manipulator.session import Session
from tactbench.rigs.parallel_manipulator.settings import JOINTS
from tests.rigs.parallel_manipulator.presses import load
from tests.rigs.parallel_manipulator.spring import Pressed, SpringRig, file_of, ramp, with_joints
from tests.rigs.parallel_manipulator.test_press import RARER

FILE = RigFile.model_validate(
    with_joints(settings__places__reach_x_mm=[-15.0, 15.0], settings__places__reach_s_mm=[-15.0, 15.0], **RARER)
)


def drives(session):
    """Return the emulated drives of motor and rails."""
    return {name: session.emulated._devices[name].emulator.drive for name in ("motor", *JOINTS)}


def true_place_m(session):
    """Return where the platform stands, whatever its drives count."""
    joints_m = np.array([drives(session)[name].position_m for name in JOINTS])
    return forward(session.settings.manipulator, joints_m)


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


def test_the_platform_is_where_it_believes_to_be_scene_after_scene_and_an_operator_is_asked_once(session):
    rng, asked = np.random.default_rng(7), []
    for _ in range(3):
        xy_m = rng.uniform(-12e-3, 12e-3, 2)
        place = session.travel(tuple(xy_m), lambda doing, text: not asked.append(text))
        assert place == pytest.approx((*xy_m, -0.15), abs=20e-6)
        # Three rails, each within its corridor of 10 um.
        assert np.linalg.norm(true_place_m(session) - place) < 20e-6
    assert sum(event.text.startswith("homing") for event in session.guard.events) == 4
    clear, push, _ = asked
    assert "joint-3" in clear
    assert "306 g" in push
    assert session.checked.startswith("3 N ")


def test_a_scene_is_the_same_in_its_own_session_each_time():
    rig = ParallelManipulator(file_of(**RARER), None, ScenePhysics(SpringRig(5.0)))
    icub, found = load_registry().sensors["icub"], []
    for _ in range(2):
        with rig.open(icub, ramp(0.5, 0.2, 0.4), seed=1) as acquisition:
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
    with pytest.raises(RigError, match="while travelling"):
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


def test_no_rail_moves_unless_the_motor_is_retracted(session):
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
    assert refused.reason.startswith("motor ")


def test_random_faults_of_all_axes_keep_the_force_below_its_bound():
    """A few of the 200 of benchmarks/axes_faults.py."""
    for outcome in load("axes_faults").schedules(4, 200):
        assert outcome.wrong == (), outcome
