from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import Scene, assumed
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.effects.heat import (
    HeatedCore,
    Thermistor,
)

CORE = HeatedCore(room_c=23.0, power_w=0.25, resistance_k_per_w=136.0, capacity_j_per_k=3.7)
SCENE = Scene(name="s")


def _equilibrium(conductance, indenter_c):
    loss = 1 / CORE.resistance_k_per_w + conductance
    goal = (CORE.power_w + CORE.room_c / CORE.resistance_k_per_w + conductance * indenter_c) / loss
    return goal, CORE.capacity_j_per_k / loss


@given(
    st.lists(st.one_of(st.just(0.0), st.floats(1e-3, 1e4)), min_size=1, max_size=30),
    st.floats(0, 0.05),
    st.floats(-20, 120),
    st.floats(0, 80),
)
def test_a_constant_contact_is_followed_exactly_whatever_the_steps(steps, conductance, indenter_c, start_c):
    t_s = np.concatenate([[0.0], np.cumsum(steps)])
    found = CORE.carried(t_s, np.full(t_s.size, conductance), indenter_c, start_c)
    goal, tau = _equilibrium(conductance, indenter_c)
    # Rounding of numbers of some hundred.
    np.testing.assert_allclose(found, goal + (start_c - goal) * np.exp(-t_s / tau), atol=1e-10)


def test_the_untouched_core_is_the_same_circuit_without_a_contact():
    t_s = np.linspace(0, 900, 40)
    alone = CORE.untouched(SCENE, t_s)
    np.testing.assert_allclose(CORE.carried(t_s, np.zeros(40), 0.0, float(alone[0])), alone, rtol=1e-13)
    cold = SCENE.model_copy(update={"environment": Environment(since_power_on=assumed(0, "s", "t"))})
    assert CORE.untouched(cold, np.zeros(1))[0] == CORE.room_c
    warm = SCENE.model_copy(update={"environment": Environment(drift_scale=0.0)})
    assert CORE.untouched(warm, np.zeros(1))[0] == CORE.room_c + CORE.rise_k


MAKERS = Thermistor(b_k=4025.0, p=155183.0, q=46555.0, full_scale=4095.0)


def by_the_maker(reading: float) -> float:
    x = reading / 4095
    return 4025 / math.log((155183 - 46555 * x) / x) - 273.15


@given(st.floats(-40, 120))
def test_the_makers_formula_leads_back(degc):
    assert by_the_maker(float(MAKERS.reading(np.array([degc]))[0])) == pytest.approx(degc, abs=1e-9)


def test_the_biotacs_rest_is_its_warm_core(specs):
    biotac = specs["biotac"]
    (channel,) = biotac.channels("dc_temperature")
    thermistor = Thermistor.of(biotac, channel.upper)
    rise = biotac.parameters["heater_power"].to("W") * biotac.parameters["heat_resistance"].to("K/W")
    assert thermistor.reading(np.array([23.0 + rise]))[0] == pytest.approx(channel.rest.value, abs=1e-6)
    assert Thermistor.of(specs["icub"], 255.0) is None
