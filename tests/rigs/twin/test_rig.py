"""The twin through its seam: what a user of a rig sees."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from tactbench.core.spec.scene import NUISANCES, ForceLoop, Simulation
from tactbench.plugin import (
    ForceRamp,
    Indenter,
    NotApplicable,
    Placement,
    RigContext,
    Scene,
)
from tactbench.plugin.simulation import EffectDescriptor, Environment, Slide
from tactbench.rigs.twin.planner import prepare
from tactbench.rigs.twin.rig import build
from tests.rigs.twin.conftest import EFFECTS, SILENT, TWIN, named, q

CAP = Indenter(radius=q(10.0))


def _scene(name="cap", **more):
    return Scene(name=name, indenter=CAP, profile=more.pop("profile", ForceRamp(samples=500)), **more)


def _record(sensor, scene, seed=1, rig=TWIN):
    """Return the recording, and of each of its streams the times, data and quality."""
    with rig.open(sensor, scene, seed=seed) as acquisition:
        return acquisition, {block.stream: (block.t_ns, block.data, block.quality) for block in acquisition}


def test_a_recording_has_the_shape_it_promises(sensors):
    acquisition, streams = _record(sensors["icub"], _scene(profile=ForceRamp(samples=2300)))
    (stream,) = acquisition.streams
    t_ns, data, quality = streams[stream.name]
    assert data.shape == (2300, 12) == quality.shape
    assert data.dtype == np.dtype(stream.dtype) == np.uint8
    assert t_ns.dtype == np.int64
    assert t_ns[0] == 0
    assert np.all(np.diff(t_ns) > 0)
    assert stream.rate_hz == pytest.approx(2300 / 60)
    (reference,) = acquisition.reference
    assert [channel.name for channel in reference.channels] == ["fz"]
    assert reference.channels[0].kind == "force"
    np.testing.assert_array_equal(streams["force_torque"][0], t_ns)
    assert streams["force_torque"][1].dtype == np.float64
    assert dict(acquisition.assumptions) == {
        "contact_x_mm": -0.3, "contact_s_mm": 0.0, "placement_scatter_mm": 0.1, "drift_scale": 1.0, "noise_scale": 1.0,
        "force_noise_n": 0.6875, "session_offset_scale": 0.0, "since_power_on_s": 3600.0,
    }  # fmt: skip
    assert acquisition.drawn["solver_residual"] < 1e-6
    assert acquisition.drawn["table_error_count"] < 1.0


def test_the_place_of_contact_is_stated_with_the_commanded_offset(sensors):
    moved = Placement(x=q(1.5), s=q(-0.5), scatter=q(0.2))
    acquisition, _ = _record(sensors["biotac"], _scene(placement=moved, profile=ForceRamp(samples=20)))
    assumed_x, assumed_s = (acquisition.assumptions[f"contact_{axis}_mm"] for axis in "xs")
    assert (assumed_x, assumed_s) == (-3.5, -0.5)
    # Where this recording met the skin is drawn about it.
    drawn_x, drawn_s = (acquisition.drawn[f"placed_{axis}_mm"] for axis in "xs")
    assert 0 < np.hypot(drawn_x - assumed_x, drawn_s - assumed_s) < 5 * 0.2


def test_the_tilt_of_each_mounting_is_drawn_beside_its_place(sensors):
    scenes = [_scene(name, profile=ForceRamp(samples=20)).simulated_as(Simulation(nuisances=nuisances))
              for name in ("cap", "cap again") for nuisances in ({}, {"placement_tilt_scatter_deg": 1.0})]  # fmt: skip
    upright, tilted, _, other = (_record(sensors["icub"], scene) for scene in scenes)
    assert upright[0].drawn["placed_x_mm"] == tilted[0].drawn["placed_x_mm"]
    assert "tilted_x_deg" not in upright[0].drawn
    drawn = [[one[0].drawn[f"tilted_{axis}_deg"] for axis in "xs"] for one in (tilted, other)]
    assert len({*drawn[0], *drawn[1]}) == 4
    assert 0 < np.abs(drawn).max() < 5
    (stream,) = upright[0].streams
    assert not np.array_equal(upright[1][stream.name][1], tilted[1][stream.name][1])


def test_nuisances_that_are_set_change_the_recording_and_are_stated(sensors):
    held = _scene(profile=ForceRamp(end=q(0.0, "N"), samples=2000), environment=SILENT)
    values = {"noise_scale": 1.0, "taxel_white_count": 9.0, "taxel_step_count": 0.0, "placement_tilt_x_rad": 0.0}
    acquisition, streams = _record(sensors["biotac"], held.simulated_as(Simulation(nuisances=values)))
    assert values.items() <= acquisition.assumptions.items()
    assert "placement_tilt_x_rad" not in _record(sensors["biotac"], held)[0].assumptions
    noise = streams["electrodes"][1].std(axis=0)
    # 2000 samples of 19 electrodes, stored in whole counts: the standard error of the mean deviation is 0.36 %; five.
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(np.hypot(9.0, 12**-0.5), rel=0.02)


def test_what_a_recording_assumes_has_the_names_under_which_it_is_set(sensors):
    slide = Slide(speed=q(5.0, "mm/s"), start=q(0.0, "s"))
    warm = Environment(indenter_temperature=q(30.0, "degC"), force_filter=q(5.0, "Hz"), offset_scale=2.0)
    parts = {"drive": ForceLoop(), "slide": slide, "environment": warm}
    acquisition, _ = _record(sensors["icub"], _scene(profile=ForceRamp(samples=200), **parts))
    commanded = {"contact_x_mm", "contact_s_mm", "slide_mm_s"}
    assert acquisition.assumptions.keys() - commanded <= NUISANCES.keys()


def test_a_scenario_changes_the_recording_and_is_stated(sensors):
    hard = _scene(profile=ForceRamp(samples=50), simulation=Simulation(scenario="hard-handled"))
    acquisition, streams = _record(sensors["biotac"], hard)
    usual, others = _record(sensors["biotac"], _scene(profile=ForceRamp(samples=50)))
    assert acquisition.assumptions["scenario"] == "hard-handled"
    assert "scenario" not in usual.assumptions
    assert not np.array_equal(streams["electrodes"][1], others["electrodes"][1])
    with pytest.raises(NotApplicable, match="scenario"):
        _record(sensors["icub"], hard)


def test_the_warm_up_rises_towards_rest(sensors):
    def level(since):
        environment = SILENT.model_copy(update={"drift_scale": 1.0, "since_power_on": q(since, "s")})
        scene = _scene(environment=environment, profile=ForceRamp(end=q(0.0, "N"), samples=20))
        _, streams = _record(sensors["biotac"], scene)
        return streams["electrodes"][1].mean()

    cold, warm, hot = level(0.0), level(500.0), level(5e5)
    # 90 counts in all, of which exp(-1) are to come after one time constant; factors scatter by 15 % over 19
    # channels (mean +-3 counts, but the same ones in every recording), rounding by half a count, wander by .1.
    rise = hot - cold
    assert 75 < rise < 105
    assert (hot - warm) / rise == pytest.approx(np.exp(-1), abs=0.03)


def test_only_observed_kinds_are_recorded_and_planned(sensors):
    acquisition, _ = _record(sensors["biotac"], _scene())
    assert {channel.kind for stream in acquisition.streams for channel in stream.channels} == {"taxel"}
    assert not named(acquisition.plan)["fluid-pressure"].included
    both, wider = _record(sensors["biotac"], _scene(observe=("taxel", "dc_pressure")))
    (stream,) = both.streams
    assert [channel.name for channel in stream.channels][-1] == "PDC"
    assert {entry.effect for entry in both.plan if entry.included} >= {"fluid-pressure", "core", "creep"}
    pdc = wider["electrodes"][1][:, -1].astype(float)
    # The fluid's pressure rises under load: hundreds of counts at 5 N, far above noise and offset.
    assert pdc[-20:].mean() - pdc[:20].mean() > 100


def test_what_the_twin_does_not_model_is_not_applicable(sensors):
    biotac = sensors["biotac"].spec
    unheated = {name: value for name, value in biotac.parameters.items() if name != "heater_power"}
    unknown = sensors["biotac"].model_copy(update={"spec": biotac.model_copy(update={"parameters": unheated})})
    with pytest.raises(NotApplicable, match="ac_temperature"):
        _record(unknown, _scene(observe=("taxel", "ac_temperature")))
    with pytest.raises(NotApplicable, match="dc_temperature"):
        _record(sensors["icub"], _scene(observe=("dc_temperature",)))
    bare = sensors["icub"].model_copy(update={"spec": sensors["icub"].spec.model_copy(update={"skin": None})})
    with pytest.raises(NotApplicable, match="no skin"):
        _record(bare, _scene())


def test_a_strangers_effect_takes_part(sensors, tmp_path, monkeypatch):
    (tmp_path / "dew.py").write_text(
        "from tactbench.plugin.simulation import Reason\n"
        "def called_for(scene, sensor):\n    return Reason(True, 'it is raining')\n"
        "def apply(run):\n    for track in run.tracks:\n        track.readings -= 7\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    dew = EffectDescriptor(
        name="dew", title="Dew", where="dew:apply", called_for="dew:called_for", produces=("disturbance",)
    )
    wet = build(RigContext(effects=(*EFFECTS, dew)))
    scene = _scene(environment=SILENT)
    acquisition, after = _record(sensors["icub"], scene, rig=wet)
    _, before = _record(sensors["icub"], scene)
    np.testing.assert_array_equal(before["taxels"][1].astype(int) - after["taxels"][1], 7)
    assert ("dew", True, "it is raining") in [(e.effect, e.included, e.reason) for e in acquisition.plan]


def test_what_a_plan_leaves_out_is_never_imported(sensors):
    code = """
import sys
from tactbench.plugin import *
from tactbench.plugin.simulation import *
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.rig import build
from tactbench.sensors.icub import tactbench_sensors
q = lambda v, u: assumed(v, u, "test")
rig = build(RigContext(effects=tuple(tactbench_effects())))
quiet = Environment(noise_scale=0.0, drift_scale=0.0, force_noise=q(0.0, "N"))
scene = Scene(name="flat", environment=quiet, profile=ForceRamp(samples=50))
with rig.open(tactbench_sensors()[0], scene, seed=1) as acquisition:
    list(acquisition)
mine = sorted(m.removeprefix("tactbench.rigs.twin.") for m in sys.modules if m.startswith("tactbench.rigs.twin."))
print(" ".join(mine))
"""
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "effects.creep" in answer
    assert "effects.channels" in answer
    assert "contact.shell" not in answer
    for left_out in ("force_loop", "friction", "heat", "skin_vibration"):
        assert f"effects.{left_out}" not in answer


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_only_what_the_plan_includes_is_stepped(sensors, name):
    plan = TWIN.plan(sensors[name], _scene())
    run = prepare(sensors[name], _scene(), 1, plan)
    for effect in plan.stages:
        run.apply(effect)
    included = {entry.effect for entry in plan.settled(run.settled) if entry.included}
    # What the contact's solver applies is counted there.
    assert set(run.spent_s) == included - {"core", "fluid-pressure", "shear"}
    # Nothing is allocated for channels nobody looks at, nor for clocks nobody needs.
    assert [track.clock for track in run.tracks] == [""]
    assert {channel.kind for track in run.tracks for channel in track.channels} == {"taxel"}


def test_a_press_curve_ends_where_it_is_asked_to_and_agrees_with_the_scenes_own_depth(sensors):
    with TWIN.open(sensors["biotac"], _scene(), seed=1) as acquisition:
        depths_m, forces_n = acquisition.press_curve(8.0)
        deepest_mm = acquisition.drawn["depth_mm"]
    assert (depths_m[0], forces_n[0], forces_n[-1]) == (0.0, 0.0, 8.0)
    assert (np.diff(depths_m) >= 0).all()
    # 0.01 mm is what a table without channels keeps; the scene's own is of 5 N.
    assert 1e3 * np.interp(5.0, forces_n, depths_m) == pytest.approx(deepest_mm, abs=0.02)
