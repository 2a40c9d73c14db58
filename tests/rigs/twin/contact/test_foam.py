from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactbench.rigs.twin.contact.foam import Foam

LAW = Foam(k0=0.06, limit_mm=1.5, weight=np.ones((1, 1)))


def _at(u):
    tangent = np.empty((1, 1))
    pressure, energy = LAW(np.array([[u]]), tangent)
    return pressure[0, 0], tangent[0, 0], energy


@given(st.floats(-1.4, 1.4))
def test_the_hardening_law(u):
    share = abs(u) / 1.5
    pressure, tangent, energy = _at(u)
    # Closed forms up to 97 % of the densification strain; the energy's difference of near numbers costs digits.
    assert np.isclose(pressure, 0.06 * u / (1 - share), rtol=1e-12, atol=1e-300)
    assert np.isclose(tangent, 0.06 / (1 - share) ** 2, rtol=1e-12)
    assert np.isclose(energy, 1.5**2 * 0.06 * (-share - np.log1p(-share)), rtol=1e-9, atol=1e-17)


@given(st.floats(1.456, 20))
def test_beyond_97_percent_the_law_goes_on_along_its_tangent(u):
    cut = 0.97 * 1.5
    slope = 0.06 / 0.03**2
    start = 0.06 * cut / 0.03
    pressure, tangent, energy = _at(u)
    assert np.isclose(pressure, start + slope * (u - cut), rtol=1e-10)
    assert np.isclose(tangent, slope, rtol=1e-10)
    below = 1.5**2 * 0.06 * (-0.97 - np.log(0.03))
    assert np.isclose(energy, below + start * (u - cut) + slope * (u - cut) ** 2 / 2, rtol=1e-10)
