from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.spec.drive import ForceLoop
from tactbench.plugin import ForceRamp, RigContext, Scene, assumed
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.planner import plan_scene
from tactbench.rigs.twin.rig import build


def _q(value, unit):
    return assumed(value, unit, "test")


def _force(sensors, cutoff_hz, noise_n, **profile):
    environment = Environment(
        force_noise=_q(noise_n, "N"), force_filter=None if cutoff_hz is None else _q(cutoff_hz, "Hz")
    )
    scene = Scene(name="f", environment=environment, profile=ForceRamp(samples=2000, **profile))
    with build(RigContext(effects=tuple(tactbench_effects()))).open(sensors["icub"], scene, seed=1) as recording:
        blocks = [block for block in recording if block.stream == "force_torque"]
        entries = {entry.effect: entry for entry in recording.plan}
    t_s = np.concatenate([block.t_ns for block in blocks]) * 1e-9
    return t_s, np.concatenate([block.data[:, 0] for block in blocks]), entries


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
    still = {"end": _q(0.0, "N")}
    t_s, raw, plain = _force(sensors, None, 0.5, **still)
    _, filtered, _ = _force(sensors, 1.0, 0.5, **still)
    assert not plain["force-filter"].included
    assert "0 N" in plain["force-filter"].reason
    # y_n = a y_{n-1} + p x_{n-1} + q x_n on white x: sd^2 = (p^2 + q^2 + 2 a p q)/(1 - a^2).
    e = (t_s[1] - t_s[0]) * 2 * np.pi
    a = np.exp(-e)
    q = 1 - (1 - a) / e
    p = (1 - a) - q
    expected = np.sqrt((p * p + q * q + 2 * a * p * q) / (1 - a * a))
    # Some 2000 (1-a)/(1+a) = 190 independent values: a standard deviation errs by 5 %; three of them.
    assert filtered[100:].std() / raw.std() == pytest.approx(expected, rel=0.15)
    # What is filtered is the very noise that would have been recorded.
    assert np.corrcoef(raw[1:], np.diff(filtered))[0, 1] > 0.5


@pytest.mark.parametrize("cutoff_hz", [None, 1.0])
@pytest.mark.parametrize("drive", [None, ForceLoop()])
def test_whatever_moves_the_force_comes_before_what_reads_it(specs, cutoff_hz, drive):
    environment = Environment(force_filter=None if cutoff_hz is None else _q(cutoff_hz, "Hz"))
    for effects in (tactbench_effects(), tactbench_effects()[::-1]):
        plan = plan_scene(effects, Scene(name="f", environment=environment, drive=drive), specs["icub"])
        names = [effect.name for effect in plan.stages if effect.name.startswith("force-")]
        expected = {"force-loop": drive, "force-noise": True, "force-filter": cutoff_hz}
        assert names == [name for name, wanted in expected.items() if wanted]


def test_it_begins_settled(sensors):
    _, raw, _ = _force(sensors, None, 0.5)
    _, filtered, _ = _force(sensors, 1.0, 0.5)
    assert filtered[0] == raw[0]
