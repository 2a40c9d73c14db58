from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactbench.rigs.twin.contact.foam import Foam

LIMIT, CUT = 1.5, 0.97
"""Deflection at densification [mm], and the share of it up to which the law hardens."""


def hardening(u):
    """Pressure, tangent and energy of a foam of 0.06 MPa/mm."""
    share = u / LIMIT
    return 0.06 * u / (1 - share), 0.06 / (1 - share) ** 2, LIMIT**2 * 0.06 * (-share - np.log1p(-share))


@given(st.floats(-20, 20))
def test_foam_hardens_and_goes_on_along_its_tangent_near_densification(u):
    cut = min(abs(u), CUT * LIMIT)
    start, slope, below = hardening(cut)
    beyond = abs(u) - cut
    tangent = np.empty((1, 1))
    pressure, energy = Foam(k0=0.06, limit_mm=LIMIT, weight=np.ones((1, 1)))(np.array([[u]]), tangent)
    # Closed forms; the energy's difference of near numbers costs digits, and so does what lies beyond the cut.
    close = 1e-10 if beyond else 1e-12
    assert np.isclose(pressure[0, 0], np.sign(u) * (start + slope * beyond), rtol=close, atol=1e-300)
    assert np.isclose(tangent[0, 0], slope, rtol=close)
    assert np.isclose(energy, below + start * beyond + slope * beyond**2 / 2, rtol=1e-9, atol=1e-17)
