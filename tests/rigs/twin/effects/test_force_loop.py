"""The loop around a real skin, through the rig."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.spec.scene import ForceLoop
from tactbench.plugin import ForceRamp, Indenter, Scene
from tactbench.rigs.twin.contact.stages import bare_skin
from tactbench.rigs.twin.effects.force_loop import BEYOND, force_at_depth
from tactbench.rigs.twin.planner import prepare
from tests.rigs.twin.conftest import SILENT, TWIN, named, q

CAP = Indenter(radius=q(10.0))


def _scene(drive, noise_n=0.0, **profile):
    environment = SILENT.model_copy(update={"force_noise": q(noise_n, "N")})
    ramp = ForceRamp(**{"samples": 2500, "duration": q(30, "s"), "hold": q(2, "s"), **profile})
    return Scene(name="pressed", indenter=CAP, profile=ramp, environment=environment, drive=drive)


@pytest.fixture(scope="module")
def pressed(sensors):
    """Carry out a scene on the iCub fingertip: its run."""

    def press(scene, until=None):
        plan = TWIN.plan(sensors["icub"], scene)
        run = prepare(sensors["icub"], scene, 1, plan)
        for effect in plan.stages:
            run.apply(effect)
            if effect.name == until:
                break
        return run

    return press


def _unfiltered(**more):
    return ForceLoop(cutoff=None, **more)


def test_everybody_follows_the_load_of_the_loop(pressed):
    run = pressed(_scene(ForceLoop(), 0.5))
    np.testing.assert_allclose(run.tracks[0].force_n, run.load.at(run.t_s))
    assert run.drawn["loop_steps_at_end"] == 0
    # Its sensor errs by the very numbers that are recorded.
    errors = (run.reference_n - run.load.at(run.t_s)) / 0.5
    np.testing.assert_allclose(errors, run.of_recording("force").standard_normal(run.t_s.size), atol=1e-9)


def test_a_loop_with_its_own_rate_reaches_the_same_force(pressed):
    fast = pressed(_scene(ForceLoop(rate=q(500, "Hz"))), "force-loop")
    assert fast.load.t_s.size == 15000
    assert fast.load.force_n[-1] == pytest.approx(5.0, abs=0.05)


def test_a_loop_that_swings_too_far_is_held_at_the_end_of_its_table_and_says_so(pressed):
    run = pressed(_scene(_unfiltered(proportional=q(2.0, "mm/N"))), "force-loop")
    assert run.drawn["loop_steps_at_end"] > 0
    assert run.load.largest_n <= BEYOND * 5.0 * (1 + 1e-12)
    assert run.load.force_n.min() >= 0


def test_creep_is_never_left_out_behind_a_loop(sensors):
    slow = {"duration": q(1e5, "s"), "samples": 200}
    for drive, called in ((None, False), (ForceLoop(rate=q(0.01, "Hz")), True)):
        with TWIN.open(sensors["icub"], _scene(drive, **slow), seed=1) as recording:
            assert named(recording.plan)["creep"].included is called


def test_depth_and_force_undo_each_other(pressed):
    table = bare_skin(pressed(_scene(None), "contact"), 15.0)
    force_n, deepest = force_at_depth(table)
    for wanted in np.linspace(0.0, 15.0, 97):
        # The straight lines between 4001 depths; 1.5 mN of 15 N.
        assert force_n(float(table.skin(np.array([wanted])).depth_mm[0])) == pytest.approx(wanted, abs=1.5e-3)
    assert force_n(-1.0) == force_n(0.0) == 0.0
    assert force_n(2 * deepest) == pytest.approx(15.0)
