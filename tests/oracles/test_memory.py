"""The heated core against a quadrature."""

from __future__ import annotations

import math

import numpy as np

from tactbench.rigs.twin.effects.heat import HeatedCore

CORE = HeatedCore(room_c=23.0, power_w=0.25, resistance_k_per_w=136.0, capacity_j_per_k=3.7)


def order(errors: list[float]) -> float:
    """Return the order seen between the two finest of halved steps."""
    return math.log2(errors[-2] / errors[-1])


def test_a_heated_core_under_a_growing_contact_is_of_second_order():
    """Against its solution as an integral, taken by Gauss's rule."""
    rate, indenter_c, start_c, end_s = 2e-4, 5.0, 57.0, 60.0
    points, weights = np.polynomial.legendre.leggauss(60)
    s = 0.5 * end_s * (points + 1)

    def decay(t):
        return np.exp(-(t / CORE.resistance_k_per_w + 0.5 * rate * t**2) / CORE.capacity_j_per_k)

    source = CORE.power_w + CORE.room_c / CORE.resistance_k_per_w + rate * s * indenter_c
    gained = 0.5 * end_s * np.sum(weights * source / decay(s)) / CORE.capacity_j_per_k
    true, errors = float(decay(end_s) * (start_c + gained)), []
    for n in (15, 30, 60):
        t_s = np.linspace(0, end_s, n + 1)
        errors.append(abs(float(CORE.carried(t_s, rate * t_s, indenter_c, start_c)[-1]) - true))
    assert 1.9 <= order(errors) <= 2.1
    assert errors[-1] <= 1e-3  # a tenth of a count of the BioTac's temperature
