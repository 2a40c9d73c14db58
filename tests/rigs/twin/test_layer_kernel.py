"""The layer's answer to a wave of pressure, in the limits that are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from tactbench.rigs.twin.contact.media import compliance_shape, shear_shapes


@given(st.floats(0, 0.5), st.floats(20, 400))
def test_short_waves_see_a_half_space(poisson, q):
    # The correction falls like q² e^-2q: 1e-14 at q = 20.
    assert compliance_shape(np.array([q]), poisson)[0] == pytest.approx(1.0, abs=1e-12)
    assert np.array(shear_shapes(np.array(q), poisson)) == pytest.approx([0.5 - poisson, 1 - poisson, 1.0], abs=1e-12)


@given(st.floats(0, 0.49), st.floats(1e-8, 1e-5))
def test_long_waves_see_a_winkler_foundation(poisson, q):
    expected = q * (1 - 2 * poisson) / (2 * (1 - poisson) ** 2)
    # The next term is of relative order q² / (1 - 2 nu): 5e-9.
    assert compliance_shape(np.array([q]), poisson)[0] == pytest.approx(expected, rel=1e-7)


@given(st.floats(1e-8, 1e-3))
def test_long_waves_in_an_incompressible_layer_squeeze_a_film(q):
    # The next term is of relative order q²: 1e-6 times a small factor.
    assert compliance_shape(np.array([q]), 0.5)[0] == pytest.approx(2 / 3 * q**3, rel=1e-5)


def _by_plane_strain(q, poisson, *, pressure, traction):
    """Return how far the surface moves along itself and outwards, times G k: plane strain, from the base up.

    Unknowns across the layer are the displacements u, w and the stresses on planes of constant depth, as amplitudes of
    ``e^ix`` for k = G = 1.
    """
    lame = 2 * poisson / (1 - 2 * poisson)
    stiff = lame + 2
    across = np.array(
        [[0, -1j, 1, 0], [-1j * lame / stiff, 0, 0, 1 / stiff], [stiff - lame**2 / stiff, 0, 0, -1j * lame / stiff],
         [0, 0, -1j, 0]]
    )  # fmt: skip
    carried = expm(across * q)
    at_base = np.linalg.solve(carried[2:, 2:], np.array([traction, -pressure]))
    return carried[:2, 2:] @ at_base


@given(st.floats(0, 0.49), st.floats(0.01, 6))
def test_every_shape_solves_the_equations_of_plane_strain(poisson, q):
    squeezed, along, _ = shear_shapes(np.array(q), poisson)
    # What 4 x 4 exponentials of up to e^6, with moduli up to 50, round.
    moved, sunk = _by_plane_strain(q, poisson, pressure=1.0, traction=0.0)
    assert moved.imag == pytest.approx(squeezed, abs=1e-11)
    assert -sunk.real == pytest.approx((1 - poisson) * compliance_shape(np.array(q), poisson), abs=1e-11)
    moved, _ = _by_plane_strain(q, poisson, pressure=0.0, traction=1.0)
    assert moved.real == pytest.approx(along, abs=1e-11)


@given(st.floats(0, 0.5), st.floats(1e-8, 1e-4))
def test_long_waves_shear_a_layer_and_squeeze_it_out(poisson, q):
    squeezed, along, across = shear_shapes(np.array(q), poisson)
    # The next terms are of relative order q²: 1e-8 times a small factor.
    assert along == pytest.approx(q, rel=1e-6)
    assert across == pytest.approx(q, rel=1e-6)
    # Lubrication: a film held below and free above, under the pressure's slope; its sides give way where nu < 1/2.
    assert squeezed == pytest.approx(q**2 * (1 - 4 * poisson) / (4 * (1 - poisson)), abs=1e-6 * q**2)
