"""A press through real bytes in virtual time: emulated motor, force sensor and fingertip on a spring."""

import re

import numpy as np
import pytest

from tactbench.devices.guard_messages import Trigger
from tactbench.devices.press import PressState
from tactbench.plugin import NotApplicable, assumed, load_registry
from tactbench.plugin.devices import GuardState, LinkError, RigFile, ScenePhysics, largest_force_n
from tactbench.plugin.simulation import Slide
from tactbench.rigs.parallel_manipulator.rig import ParallelManipulator
from tactbench.rigs.parallel_manipulator.settings import JOINTS, settings_of
from tests.rigs.parallel_manipulator.spring import SpringRig, file_of, on_spring, pressed, ramp, with_joints

QUICK = {
    "settings__force_loop__rate_hz": 100.0,
    "settings__force_loop__cutoff_hz": 5.0,
    "settings__force_loop__delay_ms": 10.0,
    "settings__force_loop__integral_mm_n_s": 2.0,
    "settings__force_loop__speed_mm_s": 2.0,
    "settings__limits__heartbeat_ms": 40.0,
    "settings__touch__settle_s": 0.3,
}
"""k K = 10 at 5 N/mm."""
RARER = {**QUICK, "force__options__rate_hz": 250.0}
"""Less to compute, where no figure is of each millisecond."""


@pytest.fixture(scope="module")
def five_newtons():
    return on_spring(5.0, ramp(5.0, 0.5, 5.0), **QUICK)


def test_presses_to_the_profiles_end_and_back(five_newtons):
    found = five_newtons
    assert found.acquisition.ended == ""
    assert found.press.state is PressState.DONE
    force, t_s = found.force_n, found.t_s["force_torque"]
    assert np.abs(force[t_s < 0.5]).max() < 0.03  # five times the noise, and the zero's
    # 5 N less what the ramp of 1.1 N/s is behind.
    assert force[t_s > 4.9].mean() == pytest.approx(4.89, abs=0.05)
    wanted = np.interp(t_s, *ramp(5.0, 0.5, 5.0).profile.corners)
    on_ramp = t_s > 2
    slope = 5.0 / 4.5
    law = settings_of(file_of(**QUICK)).force_loop.law((-1.0, 1.0))
    kept = law.kept(law.period_s)
    # The filter lets the true force run ahead, the integral lets it lag: r T a/(1 - a) - r/(k ki) (derived).
    behind = slope * (law.period_s * kept / (1 - kept) - 1 / (5e3 * law.integral))
    # The newest sample of a control period is up to 1 ms old, and the motor's increments are 5 mN.
    assert (force - wanted)[on_ramp].mean() == pytest.approx(behind, abs=0.01)


def test_the_scene_has_its_time_and_every_stream_all_of_it(five_newtons):
    found = five_newtons
    assert len(found.t_s["force_torque"]) == pytest.approx(5000, abs=2)
    assert len(found.t_s["taxels"]) == pytest.approx(250, abs=2)
    for t_s in found.t_s.values():
        assert 0 <= t_s[0] < 0.05
        assert 4.95 < t_s[-1] < 5.0
        assert (np.diff(t_s) >= 0).all()
    for name, counts in found.acquisition.stream_counts.items():
        assert counts.received == counts.written == len(found.t_s[name])
        assert counts.gaps == counts.dropped == 0


def test_what_is_recorded_is_the_raw_force(five_newtons):
    # A filter of 5 Hz would leave a tenth of the noise of 5 mN from sample to sample.
    t_s, force = five_newtons.t_s["force_torque"], five_newtons.force_n
    rest = force[t_s < 0.5]
    assert rest.std() == pytest.approx(0.005, rel=0.15)
    assert np.diff(rest).std() == pytest.approx(0.005 * np.sqrt(2), rel=0.15)


def test_a_loop_that_swings_ends_the_press():
    swings = {"settings__force_loop__integral_mm_n_s": 40.0, "settings__force_loop__speed_mm_s": 20.0,
              "settings__press__error_band_n": 0.3}  # fmt: skip
    found = on_spring(5.0, ramp(5.0, 0.5, 6.0), **(RARER | swings))
    assert found.press.state is PressState.FAILED
    # Which comes first depends on where the swing has found the surface.
    assert re.search("off the wanted|softest|ceiling|touch", found.acquisition.ended)


def test_the_recording_says_what_happened(five_newtons):
    drawn = five_newtons.acquisition.drawn
    assert drawn["press state"] == "done"
    events = [text for name, text in drawn.items() if name.startswith("event")]
    assert any("touch" in text for text in events)
    assert abs(five_newtons.press.contact_m - 1e-3 * drawn["skin mm"]) < 30e-6  # 0.05 N on 5 N/mm, and its noise


def test_a_first_touch_stays_within_its_bound():
    # 0.31 N at 20 N/mm, 0.5 mm/s with a control period of 10 ms; the guard looks every millisecond.
    changes = QUICK | {"settings__force_loop__integral_mm_n_s": 0.5, "settings__touch__touch_speed_mm_s": 0.5}
    found = on_spring(20.0, ramp(0.3, 0.3, 0.6), **changes)
    assert 0.1 < found.press.touch_n <= largest_force_n(0.1, 20e3, 0.5e-3, 1.0, 0.02) <= 0.31


def test_a_motor_that_does_not_come_out_is_said():
    found = on_spring(5.0, ramp(5.0, 0.5, 20.0), devices__motor__faults=["unplug:start_s=8"], **RARER)
    assert found.acquisition.ended.startswith(f"in ramp: {Trigger.AXIS_LOST}")
    assert found.acquisition.stop("by hand") == found.press.not_out != ""


def test_a_press_that_is_stopped_retreats_within_a_control_period():
    rig = ParallelManipulator(file_of(**RARER), None, ScenePhysics(SpringRig(5.0)))
    with rig.open(load_registry().sensors["icub"], ramp(5.0, 0.5, 20.0), seed=1) as acquisition:
        next(block for block in acquisition if block.t_ns[-1] > acquisition.begin_ns + 2e9)
        assert acquisition.control.press.state is PressState.RAMP
        stopped_ns = acquisition.clock()
        assert acquisition.stop("by hand") == ""
        assert acquisition.ended == "by hand"
        retreating, out = acquisition.events[-2:]
        assert (retreating.trigger, out.state) == (Trigger.COMMANDED, GuardState.RETREATED)
        # The next period of 10 ms, and the one in which it was stopped.
        assert 0 < retreating.t_ns - stopped_ns <= 20_000_000


def test_scenes_that_the_rig_cannot_press_are_refused():
    rig = ParallelManipulator(file_of(**QUICK), None, ScenePhysics(SpringRig(5.0)))
    slide = ramp().model_copy(update={"slide": Slide(speed=assumed(1.0, "mm/s", "a test"))})
    with pytest.raises(NotApplicable, match="slides"):
        pressed(rig, slide)
    off = ramp().placement.model_copy(update={"x": assumed(5.0, "mm", "a test")})
    with pytest.raises(NotApplicable, match="reach"):
        pressed(rig, ramp().model_copy(update={"placement": off}))


def test_a_sensor_that_falls_silent_ends_the_press_and_the_motor_is_out():
    found = on_spring(5.0, ramp(1.0, 0.3, 2.0), sensors__icub__faults=["dropped-frame:start_s=6"], **RARER)
    assert found.acquisition.control.press.over
    assert found.acquisition.control.report.state is GuardState.RETREATED
    assert re.search(r" 1\d\d ms", found.acquisition.ended)
    assert 0.1 < found.t_s["force_torque"][-1] < 2.0


def test_the_manipulator_goes_to_the_scenes_place_before_it_presses():
    said = with_joints(settings__places__reach_x_mm=[-15.0, 15.0], **RARER)
    rig = ParallelManipulator(RigFile.model_validate(said), None, ScenePhysics(SpringRig(5.0)))
    scene = ramp(1.0, 0.3, 1.5)
    place = scene.placement.model_copy(update={"x": assumed(12.0, "mm", "a test")})
    found = pressed(rig, scene.model_copy(update={"placement": place}))
    assert found.acquisition.ended == ""
    drawn = found.acquisition.drawn
    x, y, z = (float(text) for text in drawn["platform mm"].split(", "))
    # Three joints, each within its corridor of 10 um.
    assert (x, y, z) == pytest.approx((12.0, 0.0, -150.0), abs=0.05)
    # The motor is homed first and retracts, then one rail after the other; all moves are under the armed guard.
    events = [text.split()[-1] for name, text in drawn.items() if name.startswith("event")]
    assert events[:7] == ["started", "motor", *JOINTS, "armed", "disarmed"]
    assert events[8:10] == ["disarmed", "armed"]


def test_of_four_drives_of_one_kind_the_error_says_which_joint_is_silent():
    said = with_joints(**{"devices__joint-2__faults": ["late:delay_s=9"]}, **RARER)
    rig = ParallelManipulator(RigFile.model_validate(said), None, ScenePhysics(SpringRig(5.0)))
    with pytest.raises(LinkError, match="joint-2"):
        pressed(rig, ramp(1.0, 0.3, 1.0))
