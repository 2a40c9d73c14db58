"""Gains and levels: how large, how smooth over the finger, and what belongs to a recording, a session or a unit."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.plugin import ForceRamp, Scene
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.effects import creep
from tactbench.rigs.twin.effects.channels import gain, offset, rest_spread, smooth_basis, unit_rest
from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.planner import plan_scene, prepare
from tactbench.sensors.biotac.channels import ELECTRODES
from tests.rigs.twin.conftest import EFFECTS

SEEDS = 400
PRESS = ForceRamp(samples=20)


def after(sensor, *effects, seed=1, channels=None, **scene):
    """Return the run after some effects on readings of zero, of all channels or so many."""
    made = Scene(**{"name": "a", "profile": PRESS, **scene})
    run = prepare(sensor, made, seed, plan_scene(EFFECTS, made, sensor.spec))
    (track,) = run.tracks
    track.channels = track.channels[:channels]
    track.readings = np.zeros((20, len(track.channels)))
    for effect in effects:
        effect(run)
    return run


def levels(sensor, *effects, **more):
    return after(sensor, *(effects or (offset,)), **more).tracks[0].readings[0]


def _without_shared(sensor):
    taxel = sensor.spec.nuisances["taxel"]
    alone = taxel.model_copy(update={"offset_shared": taxel.offset_shared.model_copy(update={"value": 0.0})})
    spec = sensor.spec.model_copy(update={"nuisances": {**sensor.spec.nuisances, "taxel": alone}})
    return sensor.model_copy(update={"spec": spec})


@pytest.fixture(scope="module")
def own(sensors):
    """(seeds, electrodes) own offsets of the BioTac."""
    alone = _without_shared(sensors["biotac"])
    return np.array([levels(alone, seed=seed) for seed in range(SEEDS)])


def _quadratics():
    """(electrodes, 6) the monomials of a quadratic in (x, arc angle)."""
    x = np.array([place.x_mm for place in ELECTRODES])
    angle = np.array([np.arctan2(place.y_mm, -place.z_mm) for place in ELECTRODES])
    return np.stack([np.ones_like(x), x, angle, x * x, x * angle, angle * angle], axis=1)


def _explained(rows):
    """The share of variance over electrodes that a quadratic, fitted to each row, explains."""
    design = _quadratics()
    left = rows.T - design @ np.linalg.lstsq(design, rows.T, rcond=None)[0]
    centred = rows - rows.mean(axis=1, keepdims=True)
    return 1.0 - np.sum(left**2) / np.sum(centred**2)


def test_a_quadratic_over_the_finger_explains_what_was_measured(own):
    # 0.86 smooth, and of the rest the five coefficients explain 5 in 18: 0.899, inside the measured 0.87 to 0.93. Sums
    # over 400 seeds of 5 and 13 squares leave 0.0033 of it uncertain: four of those.
    assert _explained(own) == pytest.approx(0.86 + 0.14 * 5 / 18, abs=0.013)


def test_their_mean_square_over_electrodes_and_recordings_is_the_stated_one(own, sensors):
    stated = sensors["biotac"].spec.nuisances["taxel"].offset_own.value
    # The mean square of 400 fields with five smooth degrees of freedom is uncertain by 2.8 %: four of those, halved.
    assert np.sqrt(np.mean(own**2)) == pytest.approx(stated, rel=0.056)
    # The field takes nothing of what electrodes share: what is left in their mean is a nineteenth of the own rest.
    assert np.sqrt(np.mean(own.mean(axis=1) ** 2)) == pytest.approx(stated * np.sqrt(0.14 / 19), rel=0.15)


def test_the_space_of_fields_does_not_depend_on_how_places_are_written(sensors):
    spec = sensors["biotac"].spec
    basis = smooth_basis(spec, "taxel")
    assert basis.shape == (19, 5)
    np.testing.assert_allclose(basis.T @ basis, np.eye(5), atol=1e-12)
    # It holds every quadratic over the finger, and so nothing else.
    centred = _quadratics()[:, 1:] - _quadratics()[:, 1:].mean(axis=0)
    np.testing.assert_allclose(basis @ (basis.T @ centred), centred, rtol=0, atol=1e-10 * np.abs(centred).max())
    # Shifted and stretched along the finger, the quadratics are the same functions of the electrodes.
    places = [channel.position_m for channel in spec.channels("taxel")]
    other = smooth_basis(_placed(spec, *((3.0 * x + 0.5, y, z) for x, y, z in places)), "taxel")
    np.testing.assert_allclose(basis @ basis.T, other @ other.T, atol=1e-10)


def _placed(spec, *places):
    """The spec with as many taxels as places."""
    stream = spec.streams[0]
    channels = tuple(
        channel.model_copy(update={"position_m": place})
        for channel, place in zip(stream.channels, places, strict=False)
    )
    return spec.model_copy(update={"streams": (stream.model_copy(update={"channels": channels}),)})


def test_few_places_or_none_leave_fewer_fields_or_none(sensors):
    spec = sensors["biotac"].spec
    on_a_line = _placed(spec, *((1e-3 * number, 0.0, -5e-3) for number in range(6)))
    assert smooth_basis(on_a_line, "taxel").shape == (6, 2)  # straight and bent
    assert smooth_basis(_placed(spec, (0.0, 0.0, -5e-3), None), "taxel") is None


def test_own_offsets_change_with_the_recording_and_session_offsets_do_not(sensors):
    icub, drifting = sensors["icub"], Environment(session_offset_scale=1.0)
    a, again, b = (levels(icub, name=name, environment=drifting) for name in ("a", "a", "b"))
    np.testing.assert_array_equal(a, again)
    # The session's part (0.8 counts) is common to both: what differs is own (0.2 each), so sd 0.28 over 12 taxels;
    # 0.13 and 0.5 are more than four standard errors of an sd of 12 numbers away only for a wrong scope.
    assert 0.05 < np.std(a - b) < 0.6
    other_session = levels(icub, session="2", environment=drifting)
    assert np.std(other_session - a) > 2 * np.std(a - b)


@pytest.mark.parametrize(("drift", "own", "factor"), [(2.0, None, 2.0), (0.0, 3.0, 3.0), (5.0, 0.0, 0.0)])
def test_a_stated_scale_of_offsets_takes_over_from_that_of_drift(sensors, drift, own, factor):
    plain, scaled = (
        levels(sensors["biotac"], environment=environment)
        for environment in (Environment(), Environment(drift_scale=drift, offset_scale=own))
    )
    assert np.abs(plain).max() > 1
    np.testing.assert_allclose(scaled, factor * plain, rtol=1e-13)


def test_recording_fewer_channels_changes_none(sensors):
    every, few = (after(sensors["biotac"], offset, gain, channels=wanted).tracks[0] for wanted in (None, 5))
    np.testing.assert_array_equal(every.gain[:5], few.gain)
    np.testing.assert_array_equal(every.readings[:, :5], few.readings)


def test_gains_scatter_about_one_and_belong_to_the_unit_as_rest_levels_do(sensors):
    gains = np.concatenate([after(sensors["biotac"], gain, seed=seed).tracks[0].gain for seed in range(40)])
    # 760 numbers of sd 0.05: standard errors 0.0018 and 0.0013, four of each.
    assert gains.mean() == pytest.approx(1.0, abs=0.0073)
    assert gains.std() == pytest.approx(0.05, abs=0.0052)
    first, second = (after(sensors["biotac"], gain, name=name).tracks[0].gain for name in ("a", "b"))
    np.testing.assert_array_equal(first, second)
    first, second = (levels(sensors["icub"], rest_spread, name=name) for name in ("a", "b"))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("name", ["biotac", "icub"])
def test_units_differ_by_what_belongs_to_a_unit_and_by_nothing_else(sensors, name):
    first, second, third = (after(sensors[name], unit=unit) for unit in "123")
    assert len({run.of_unit("gain", "taxel").standard_normal() for run in (first, second, third)}) == 3
    for scope in ("of_recording", "of_session"):
        assert getattr(first, scope)("x").standard_normal() == getattr(second, scope)("x").standard_normal()
    assert first.contact == second.contact, "the same mounting, on another unit"


UNITS = [str(number) for number in range(2, 122)]


def test_rest_levels_of_units_spread_as_stated(sensors):
    stated = sensors["biotac"].spec.nuisances["taxel"]
    found = np.array([levels(sensors["biotac"], unit_rest, unit=unit) for unit in UNITS])
    shared, own = stated.unit_rest_shared.value, stated.unit_rest_own.value
    # 120 units: a standard deviation of 120 numbers is known to 6.5 %, of 120 x 18 to 1.5 %; four of each. The mean of
    # 19 electrodes scatters by what is shared and a nineteenth of the own variance.
    assert found.mean(axis=1).std() == pytest.approx(np.hypot(shared, own / np.sqrt(19)), rel=0.26)
    within = found - found.mean(axis=1, keepdims=True)
    assert within.std() == pytest.approx(own * np.sqrt(18 / 19), rel=0.06)
    assert not levels(sensors["biotac"], unit_rest).any(), "the first unit is the one that the spec describes"


def test_gains_of_units_differ_as_a_whole_and_never_turn_round(sensors):
    gains = np.array([after(sensors["icub"], gain, unit=unit).tracks[0].gain for unit in UNITS])
    # sd 0.1 shared, known to 6.5 % from 120 units; 0.05 each adds 0.0144 to the mean of 12.
    assert gains.mean(axis=1).std() == pytest.approx(np.hypot(0.1, 0.05 / np.sqrt(12)), rel=0.26)
    assert (gains > 0).all()


def test_creep_shares_the_load_among_now_and_later(sensors):
    run = after(sensors["biotac"], creep.apply, observe=("taxel", "dc_pressure"))
    (track,), terms = run.tracks, sensors["biotac"].spec.nuisances["taxel"].creep
    expected = track.force_n * (1 - sum(t.fraction.value for t in terms))
    for term in terms:
        expected = expected + term.fraction.value * lag(track.t_s, track.force_n, term.tau.to("s"))
    np.testing.assert_allclose(track.effective_n["taxel"], expected, rtol=1e-12, atol=1e-15)
    # On a rising load the response lags, and by no more than the shares that may.
    assert np.all(track.effective_n["taxel"] <= track.force_n)
    assert np.all(track.effective_n["taxel"] >= 0.89 * track.force_n - 1e-12)
    assert "dc_pressure" not in track.effective_n
