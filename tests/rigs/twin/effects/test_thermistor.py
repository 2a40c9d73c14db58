from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.rigs.twin.effects.thermistor import Thermistor

MAKERS = Thermistor(b_k=4025.0, p=155183.0, q=46555.0, full_scale=4095.0)


@given(st.floats(-40, 120))
def test_there_and_back(degc):
    assert MAKERS.degc(MAKERS.reading(np.array([degc])))[0] == pytest.approx(degc, abs=1e-9)


def test_the_makers_formula_at_rest():
    x = 2576 / 4095
    by_hand = 4025 / math.log((155183 - 46555 * x) / x) - 273.15
    assert by_hand == pytest.approx(56.59, abs=0.005)
    assert MAKERS.reading(np.array([by_hand]))[0] == pytest.approx(2576, abs=1e-8)


def test_counts_rise_with_temperature_and_stay_on_the_converter():
    readings = MAKERS.reading(np.linspace(-300, 1000, 500))
    assert np.all(np.diff(readings) >= 0)
    assert readings.min() >= 0
    assert np.all(np.isfinite(readings))


def test_the_biotacs_rest_is_its_warm_core(specs):
    biotac = specs["biotac"]
    (channel,) = biotac.channels("dc_temperature")
    thermistor = Thermistor.of(biotac, channel.upper)
    rise = biotac.parameters["heater_power"].to("W") * biotac.parameters["heat_resistance"].to("K/W")
    assert thermistor.reading(np.array([23.0 + rise]))[0] == pytest.approx(channel.rest.value, abs=1e-6)
    assert Thermistor.of(specs["icub"], 255.0) is None
