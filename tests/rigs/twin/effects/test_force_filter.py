from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.spec.drive import ForceLoop
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


def test_noise_shrinks_as_a_first_order_filter_shrinks_it(sensors):
    still = {"end": q(0.0, "N")}
    t_s, raw, plain = _force(sensors, None, 0.5, **still)
    _, filtered, _ = _force(sensors, 1.0, 0.5, **still)
    assert not plain["force-filter"].included
    # y_n = a y_{n-1} + p x_{n-1} + q x_n on white x: sd^2 = (p^2 + q^2 + 2 a p q)/(1 - a^2); p last, q now.
    e = (t_s[1] - t_s[0]) * 2 * np.pi
    a = np.exp(-e)
    now = 1 - (1 - a) / e
    last = (1 - a) - now
    expected = np.sqrt((last * last + now * now + 2 * a * last * now) / (1 - a * a))
    # Some 2000 (1-a)/(1+a) = 190 independent values: a standard deviation errs by 5 %; three of them.
    assert filtered[100:].std() / raw.std() == pytest.approx(expected, rel=0.15)
    # What is filtered is the very noise that would have been recorded.
    assert np.corrcoef(raw[1:], np.diff(filtered))[0, 1] > 0.5


def test_whatever_moves_the_force_comes_before_what_reads_it(specs):
    scene = Scene(name="f", environment=Environment(force_filter=q(1.0, "Hz")), drive=ForceLoop())
    for effects in (EFFECTS, EFFECTS[::-1]):
        names = [effect.name for effect in plan_scene(effects, scene, specs["icub"]).stages]
        assert [name for name in names if name.startswith("force-")] == ["force-loop", "force-noise", "force-filter"]
        assert names.index("contact") < names.index("creep") < names.index("transduction") < names.index("converter")
