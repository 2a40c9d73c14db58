"""Closed forms against themselves: the way back, the load they carry, their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.rigs.twin.closed_forms.adhesion import Jkr
from tactbench.rigs.twin.closed_forms.half_space import FlatPunch, Hertz, point_load_mm
from tactbench.rigs.twin.closed_forms.layers import IncompressibleLayer, Winkler, oedometric_mpa
from tactbench.rigs.twin.closed_forms.tangential import CattaneoMindlin

sizes = st.floats(0.1, 100)


def carried(law, force: float, radius: float) -> float:
    """Integrate a pressure over its contact by Gauss's rule in the angle whose sine is r/a."""
    angle, weight = np.polynomial.legendre.leggauss(60)
    angle, weight = (angle + 1) * math.pi / 4, weight * math.pi / 4
    r = radius * np.sin(angle)
    return float(np.sum(weight * law.pressure_mpa(force, r) * 2 * math.pi * r * radius * np.cos(angle)))


@given(sizes, sizes, sizes)
def test_depth_and_force_are_inverse(size, stiffness, force):
    laws = (
        Hertz(size, stiffness), FlatPunch(size, stiffness), Winkler(size, stiffness),
        IncompressibleLayer(size, stiffness, 0.3),
    )  # fmt: skip
    for law in laws:
        assert law.force_n(law.depth_mm(force)) == pytest.approx(force, rel=1e-12)


@given(sizes, sizes, sizes)
def test_pressures_carry_the_force(size, stiffness, force):
    for law in (Hertz(size, stiffness), Winkler(size, stiffness), IncompressibleLayer(size, stiffness, 0.3)):
        assert carried(law, force, law.contact_radius_mm(force)) == pytest.approx(force, rel=1e-10)
        assert law.pressure_mpa(force, np.array([1.001 * law.contact_radius_mm(force)]))[0] == 0
    assert carried(FlatPunch(size, stiffness), force, size) == pytest.approx(force, rel=1e-10)


def test_a_flat_punch_presses_without_bound_at_its_rim_and_not_outside():
    at_rim, outside = FlatPunch(2.0, 1.0).pressure_mpa(1.0, np.array([2.0, 2.1]))
    assert math.isinf(at_rim)
    assert outside == 0


def test_hertz_at_numbers_worked_by_hand():
    law = Hertz(10.0, 1.0)
    assert law.contact_radius_mm(1.0) == pytest.approx(7.5 ** (1 / 3))
    assert law.largest_pressure_mpa(1.0) == pytest.approx(1.5 / (math.pi * 7.5 ** (2 / 3)))
    assert point_load_mm(2.0, np.array([4.0]), 0.5)[0] == pytest.approx(1 / math.pi)


def test_oedometric_modulus():
    assert oedometric_mpa(2.0, 0.0) == 2.0
    assert oedometric_mpa(1.0, 0.25) == pytest.approx(1.2)
    with pytest.raises(RigError, match="no oedometric modulus"):
        oedometric_mpa(1.0, 0.5)


@given(sizes, sizes, st.floats(1e-4, 1), st.floats(0, 10))
def test_sticky_radius_gives_its_force_back(radius, modulus, work, force):
    law = Jkr(radius, modulus, work)
    for load in (force, 0.99 * law.pull_off_n):
        assert law.force_n(law.contact_radius_mm(load)) == pytest.approx(load, rel=1e-7, abs=1e-9 * -law.pull_off_n)
    assert law.force_n(law.pull_off_radius_mm) == pytest.approx(law.pull_off_n, rel=1e-12)
    assert law.contact_radius_mm(law.pull_off_n) == pytest.approx(law.pull_off_radius_mm, rel=1e-7)


@example(1.0, 1.0, 1.0, 2.220446049250313e-16)  # its cube root is rounded above 1
@given(st.floats(0.05, 2), sizes, sizes, st.floats(0, 1))
def test_traction_carries_the_push_and_nowhere_exceeds_friction(friction, radius, normal, share):
    law = CattaneoMindlin(friction, radius, normal, 1.0)
    push = share * friction * normal
    r = (np.arange(20000) + 0.5) * radius / 20000
    traction = law.traction_mpa(push, r)
    # The midpoint rule on 20 000 rings, with square roots at both rims.
    total = np.sum(traction * 2 * math.pi * r) * radius / 20000
    assert total == pytest.approx(push, abs=1e-5 * friction * normal)
    pressure = 1.5 * normal / (math.pi * radius**2) * np.sqrt(1 - (r / radius) ** 2)
    # Rounding of 1 - r²/a² counts by its root where that is small.
    assert np.all(traction <= friction * pressure + 1e-7 * friction * pressure[0])
    assert 0 <= law.stick_radius_mm(push) <= radius


def test_full_slip_sticks_nowhere():
    law = CattaneoMindlin(0.5, 1.0, 2.0, 1.0)
    assert law.stick_radius_mm(1.0) == 0
    assert law.traction_mpa(1.0, np.array([0.0]))[0] == pytest.approx(0.5 * 1.5 * 2 / math.pi)
    assert law.shift_mm(1.0) == pytest.approx(1.5 * 0.5 * 2 * law.compliance_mm_per_n)
