"""The layer's answer to a wave of pressure, in the limits that are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.rigs.twin.layer_kernel import compliance_shape


@given(st.floats(0, 0.5), st.floats(20, 400))
def test_short_waves_see_a_half_space(poisson, q):
    # The correction falls like q² e^-2q: 1e-14 at q = 20.
    assert compliance_shape(np.array([q]), poisson)[0] == pytest.approx(1.0, abs=1e-12)


@given(st.floats(0, 0.49), st.floats(1e-8, 1e-5))
def test_long_waves_see_a_winkler_foundation(poisson, q):
    expected = q * (1 - 2 * poisson) / (2 * (1 - poisson) ** 2)
    # The next term is of relative order q² / (1 - 2 nu): 5e-9.
    assert compliance_shape(np.array([q]), poisson)[0] == pytest.approx(expected, rel=1e-7)


@given(st.floats(1e-8, 1e-3))
def test_long_waves_in_an_incompressible_layer_squeeze_a_film(q):
    # The next term is of relative order q²: 1e-6 times a small factor.
    assert compliance_shape(np.array([q]), 0.5)[0] == pytest.approx(2 / 3 * q**3, rel=1e-5)


@given(st.floats(0, 0.5))
def test_both_ways_of_summing_agree_where_they_meet(poisson):
    below, above = compliance_shape(np.array([0.35 - 1e-12, 0.35]), poisson)
    # Continuity to rounding: eight terms at y = 0.7 leave 1e-18.
    assert above == pytest.approx(below, rel=1e-10)


@given(st.floats(0, 0.5), st.floats(1e-6, 300), st.floats(1.01, 2))
def test_compliance_is_positive_and_finite(poisson, q, factor):
    values = compliance_shape(np.array([q, q * factor]), poisson)
    assert np.all(values > 0)
    assert np.all(np.isfinite(values))
