"""Each oracle of ``benchmarks/manipulator_oracles.py`` at a small size; the script has the full ones."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from tactbench.rigs.parallel_manipulator.kinematics import forward, inverse
from tactbench.rigs.parallel_manipulator.motion_profile import MotionProfile
from tactbench.rigs.parallel_manipulator.singularity import measures


def _load():
    path = Path(__file__).parents[3] / "benchmarks" / "manipulator_oracles.py"
    spec = importlib.util.spec_from_file_location("manipulator_oracles", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


ORACLES = _load()


@pytest.mark.parametrize("number", range(1, 8))
def test_oracle(number):
    oracle, _, small = ORACLES.ORACLES[number - 1]
    rows = oracle(np.random.default_rng([1, number]), small)
    assert rows
    assert not [row for row in rows if not row.kept]


@pytest.mark.parametrize(("name", "place", "joints", "wanted"), ORACLES.POSES)
def test_a_pose_computed_elsewhere(name, place, joints, wanted):
    delta, p = ORACLES.MACHINES[name], 1e-3 * np.array(place)
    q = inverse(delta, p)
    unit, tolerance = (1.0, 1e-13) if name == "RD" else (1e3, 1e-11)
    assert np.abs(unit * q - joints).max() <= tolerance
    # To places that are an ulp or two apart: both are rounded to double.
    assert np.abs(forward(delta, q) - p).max() <= 1e-15
    found = measures(delta, p, q)
    assert np.sign(found.det) == -1
    sideways = np.sin(found.sideways_rad.max())
    # Half a unit of the last of four decimals.
    assert (found.serial.min(), sideways) == pytest.approx((wanted[0], wanted[3]), abs=5.1e-5)
    assert (found.parallel, found.constraint) == pytest.approx(wanted[1:3], abs=1e-6)


@pytest.mark.parametrize(("distance_mm", "duration_s", "speed_mm_s"), ORACLES.DURATIONS)
def test_a_duration_computed_elsewhere(distance_mm, duration_s, speed_mm_s):
    found = MotionProfile(1e-3 * distance_mm, 0.05, 0.5, 5.0)
    assert found.duration_s == pytest.approx(duration_s, abs=1e-8)
    assert 1e3 * found.peak_m_s == pytest.approx(speed_mm_s, abs=1e-6)
