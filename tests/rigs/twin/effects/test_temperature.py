"""TDC, TAC and the electrodes' drift, seen on a whole recording."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import ForceRamp, Scene, assumed
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.contact.press import at_rest
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.effects.heat import HeatedCore, Thermistor, through_divider
from tactbench.rigs.twin.effects.memory import lag, time_constant_s
from tactbench.rigs.twin.geometry import skin_grid
from tactbench.rigs.twin.planner import plan_scene, prepare
from tactbench.sensors.biotac.transduction import build
from tests.rigs.twin.conftest import EFFECTS, named, q, unrounded

HEAT = ("dc_temperature", "ac_temperature")
REST_C = 56.59
"""The maker's formula at 2576 counts."""


def _scene(indenter_c=None, observe=HEAT, effects=(), end_n=2.0, **environment):
    quiet = {"noise_scale": 0.0, "drift_scale": 0.0, "force_noise": q(0, "N"), **environment}
    if indenter_c is not None:
        quiet["indenter_temperature"] = q(indenter_c, "degC")
    touch = ForceRamp(end=q(end_n, "N"), hold=q(1.0, "s"), duration=q(1.5, "s"), samples=150)
    return Scene(
        name="touch", profile=touch, environment=Environment(**quiet), observe=observe,
        simulation=Simulation(effects=effects),
    )  # fmt: skip


@pytest.fixture(scope="module")
def carried(sensors):
    return lambda scene: unrounded(sensors["biotac"], scene).tracks[0]


def test_a_colder_indenter_cools_the_core_and_a_hotter_one_warms_it(carried):
    cold, same, hot = (carried(_scene(degc)) for degc in (23.0, None, 90.0))
    touched = cold.t_s > 1.0
    for track, sign in ((cold, -1), (same, 0), (hot, 1)):
        change = track.readings - track.readings[0]
        np.testing.assert_array_equal(np.sign(np.round(change[touched][5:], 6)), sign)
        assert np.abs(change[~touched]).max() < 1e-6
    # In proportion to the difference of temperature, but for the curve of the thermistor.
    ratio = (hot.readings - hot.readings[0])[-1, 0] / (cold.readings - cold.readings[0])[-1, 0]
    assert ratio == pytest.approx((90 - REST_C) / (23 - REST_C), rel=0.03)


def test_a_sensor_that_warms_up_shows_it_in_tdc(carried, specs):
    track = carried(_scene(since_power_on=q(100, "s"), drift_scale=1.0, end_n=0.0))
    core = HeatedCore.of(_scene(), specs["biotac"])
    left = np.exp(-(100 + track.t_s) / core.tau_s)
    counts = Thermistor.of(specs["biotac"], 4095.0).reading(23.0 + core.rise_k * (1 - left))
    # The low-pass of 22.6 Hz is 7 ms behind a rate of 0.06 K/s, a kelvin 45 counts.
    np.testing.assert_allclose(track.readings[:, 0], counts, atol=0.045)


def test_tac_is_the_amplified_high_pass_of_tdc(carried):
    track = carried(_scene(23.0))
    t, tdc, tac = track.t_s, track.readings[:, 0], track.readings[:, 1]
    np.testing.assert_allclose(tac - 2037, 98.0 * (tdc - lag(t, tdc, time_constant_s(0.45))), atol=1e-6)


def test_the_electrodes_fall_when_the_contact_cools_the_fluid_and_not_otherwise(carried):
    seen = ("taxel", *HEAT)
    with_heat, without = carried(_scene(23.0, seen, end_n=0.5)), carried(_scene(None, seen, end_n=0.5))
    fall = (with_heat.readings - without.readings)[:, :19]
    assert np.all(fall[-1] < 0)
    # Through the divider and back: rounding of some thousand counts.
    assert np.abs(fall[with_heat.t_s <= 1.0]).max() < 1e-11
    # d reading / d ln(sigma) = E (1 - E/4095), conductivity by 2 % of that at 25 degC per kelvin.
    level = without.readings[-1, :19]
    expected = level * (1 - level / 4095) * 0.02 / (1 + 0.02 * (REST_C - 25)) * with_heat.warmth_k[-1]
    np.testing.assert_allclose(fall[-1], expected, rtol=0.01)


def test_a_sensor_without_a_heated_core_that_is_asked_keeps_still(sensors):
    icub = sensors["icub"].spec
    asked = _scene(5.0, ("taxel",), ("+contact-heat", "+thermal-drift"))
    run = prepare(sensors["icub"], asked, 1, plan_scene(EFFECTS, asked, icub))
    before = run.tracks[0].readings.copy()
    for effect in EFFECTS:
        if effect.name in ("contact-heat", "thermal-drift", "dc-temperature", "ac-temperature"):
            run.apply(effect)
    np.testing.assert_array_equal(run.tracks[0].readings, before)


@pytest.mark.parametrize(
    ("scene", "called"),
    [
        (_scene(None, ("taxel",)), False), (_scene(5.0, ("taxel",), end_n=0.0), False), (_scene(5.0, ("taxel",)), True),
        (_scene(5.0, ("dc_pressure",)), False),
    ],
)  # fmt: skip
def test_heat_is_called_for_by_an_indenters_temperature_under_load(scene, called, specs):
    assert named(plan_scene(EFFECTS, scene, specs["biotac"]).entries)["contact-heat"].included is called


def test_ends_of_the_range_stay():
    ends = np.array([0.0, 4095.0, -3.0, 5000.0])
    np.testing.assert_array_equal(through_divider(ends, np.full(4, 1.1), 4095.0), ends)


def test_one_divider_per_electrode_is_what_a_warmer_fluid_gives(specs):
    biotac = specs["biotac"]
    sigma = biotac.parameters["conductivity"].to("S/m")

    def warmed(factor):
        changed = {**biotac.parameters, "conductivity": assumed(factor * sigma, "S/m", "test")}
        spec = biotac.model_copy(update={"parameters": changed})
        grid = skin_grid(biotac.skin.sheet)
        names = [channel.name for channel in spec.channels("taxel")]
        return build(spec, grid, names, refinement=1)(at_rest(medium_of(spec.skin, grid)))

    rest, warmer = warmed(1.0), warmed(1.05)
    one_by_one = through_divider(rest, np.full(19, 1.05), 4095.0)
    # Electrodes read one at a time share nothing.
    np.testing.assert_allclose(one_by_one, warmer, rtol=1e-12)
