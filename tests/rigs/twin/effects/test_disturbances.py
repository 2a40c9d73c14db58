"""Single effects on a recording in the making."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.plugin import Scene
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.effects import creep
from tactbench.rigs.twin.effects.channels import gain, offset
from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.geometry import Contact
from tactbench.rigs.twin.synthesis import Load, Synthesis, Track


def _run(sensor, *, seed=1, name="a", session="1", wanted=None, kinds=("taxel",)):
    channels = sensor.spec.channels(*kinds)[:wanted]
    t_s = np.linspace(0, 60, 200)
    load = Load(np.array([0.0, 7.2, 60.0]), np.array([0.0, 0.0, 4.4]))
    track = Track(
        clock="",
        channels=channels,
        t_s=t_s,
        force_n=load.at(t_s),
        readings=np.zeros((200, len(channels))),
        quality=np.zeros((200, len(channels)), dtype=np.uint8),
    )
    return Synthesis(
        sensor=sensor,
        scene=Scene(name=name, session=session, environment=Environment(session_offset_scale=1.0)),
        seed=seed,
        t_s=t_s,
        load=load,
        tracks=(track,),
        contact=Contact(10.0, 0.0, 0.0),
        reference_n=load.at(t_s),
    )


def _after(effect, *args, **kwargs):
    run = _run(*args, **kwargs)
    effect(run)
    return run


def test_creep_shares_the_load_among_now_and_later(sensors):
    run = _after(creep.apply, sensors["biotac"], kinds=("taxel", "dc_pressure"))
    terms = sensors["biotac"].spec.nuisances["taxel"].creep
    expected = run.tracks[0].force_n * (1 - sum(t.fraction.value for t in terms))
    for term in terms:
        expected = expected + term.fraction.value * lag(run.t_s, run.tracks[0].force_n, term.tau.to("s"))
    np.testing.assert_allclose(run.tracks[0].effective_n["taxel"], expected, rtol=1e-12, atol=1e-15)
    # On a rising load the response lags, and by no more than the shares that may.
    assert np.all(run.tracks[0].effective_n["taxel"] <= run.tracks[0].force_n)
    assert np.all(run.tracks[0].effective_n["taxel"] >= 0.89 * run.tracks[0].force_n - 1e-12)
    assert "dc_pressure" not in run.tracks[0].effective_n


def test_own_offsets_change_with_the_recording_and_session_offsets_do_not(sensors):
    a, again, b = (_after(offset, sensors["icub"], name=name).tracks[0].readings[0] for name in ("a", "a", "b"))
    np.testing.assert_array_equal(a, again)
    # The session's part (0.8 counts) is common to both: what differs is own (0.2 each), so sd 0.28 over 12 taxels;
    # 0.13 and 0.5 are more than four standard errors of an sd of 12 numbers away only for a wrong scope.
    assert 0.05 < np.std(a - b) < 0.6
    other_session = _after(offset, sensors["icub"], session="2").tracks[0].readings[0]
    assert np.std(other_session - a) > 2 * np.std(a - b)


@pytest.mark.parametrize(("drift", "own", "factor"), [(2.0, None, 2.0), (0.0, 3.0, 3.0), (5.0, 0.0, 0.0)])
def test_a_stated_scale_of_offsets_takes_over_from_that_of_drift(sensors, drift, own, factor):
    plain, scaled = _run(sensors["biotac"]), _run(sensors["biotac"])
    plain.scene = plain.scene.model_copy(update={"environment": Environment()})
    scaled.scene = scaled.scene.model_copy(update={"environment": Environment(drift_scale=drift, offset_scale=own)})
    for run in (plain, scaled):
        offset(run)
    assert np.abs(plain.tracks[0].readings).max() > 1
    np.testing.assert_allclose(scaled.tracks[0].readings, factor * plain.tracks[0].readings, rtol=1e-13)


def test_offsets_move_all_samples_of_a_channel_alike(sensors):
    readings = _after(offset, sensors["biotac"]).tracks[0].readings
    np.testing.assert_array_equal(readings, np.tile(readings[0], (200, 1)))


@pytest.mark.parametrize("effect", [offset, gain])
def test_recording_fewer_channels_changes_none(sensors, effect):
    every, few = (_after(effect, sensors["biotac"], wanted=wanted).tracks[0] for wanted in (None, 5))
    if effect is gain:
        np.testing.assert_array_equal(every.gain[:5], few.gain)
    else:
        np.testing.assert_array_equal(every.readings[:, :5], few.readings)


def test_gains_scatter_about_one_and_belong_to_the_unit(sensors):
    gains = np.concatenate([_after(gain, sensors["biotac"], seed=seed).tracks[0].gain for seed in range(40)])
    # 760 numbers of sd 0.05: standard errors 0.0018 and 0.0013, four of each.
    assert gains.mean() == pytest.approx(1.0, abs=0.0073)
    assert gains.std() == pytest.approx(0.05, abs=0.0052)
    first, second = (_after(gain, sensors["biotac"], name=name).tracks[0].gain for name in ("a", "b"))
    np.testing.assert_array_equal(first, second)
