from __future__ import annotations

import numpy as np

from tactbench.core.spec.scene import ForceLoop
from tactbench.plugin import ForceRamp, Scene
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.planner import plan_scene
from tests.rigs.twin.conftest import EFFECTS, TWIN, named, q


def _force(sensors, cutoff_hz, noise_n, **profile):
    environment = Environment(
        force_noise=q(noise_n, "N"), force_filter=None if cutoff_hz is None else q(cutoff_hz, "Hz")
    )
    scene = Scene(name="f", environment=environment, profile=ForceRamp(samples=2000, **profile))
    with TWIN.open(sensors["icub"], scene, seed=1) as recording:
        force = recording.samples["force_torque"]
    return force.t_ns * 1e-9, force.data[:, 0], named(recording.plan)


def test_a_ramp_comes_late_by_the_time_constant(sensors):
    t_s, force, entries = _force(sensors, 0.5, 0.0)
    assert entries["force-filter"].included
    late = 1 / (2 * np.pi * 0.5)
    slope = 5.0 / 52.8
    # Settled after 20 time constants; the start of the ramp lies between two samples, so it is a straight line only
    # beside one corner, whose trace has died away as well.
    settled = t_s > 7.2 + 20 * late
    np.testing.assert_allclose(force[settled], slope * (t_s[settled] - late - 7.2), atol=1e-7)


def test_whatever_moves_the_force_comes_before_what_reads_it(specs):
    scene = Scene(name="f", environment=Environment(force_filter=q(1.0, "Hz")), drive=ForceLoop())
    for effects in (EFFECTS, EFFECTS[::-1]):
        names = [effect.name for effect in plan_scene(effects, scene, specs["icub"]).stages]
        assert [name for name in names if name.startswith("force-")] == ["force-loop", "force-noise", "force-filter"]
        assert names.index("contact") < names.index("creep") < names.index("transduction") < names.index("converter")
