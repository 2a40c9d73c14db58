"""The own part of the offsets between recordings: how large, how smooth over the finger, and under which name."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import Scene, load_registry
from tactbench.rigs.twin.effects.channels import offset, smooth_basis
from tactbench.rigs.twin.geometry import Contact
from tactbench.rigs.twin.preparation import handled
from tactbench.rigs.twin.synthesis import Load, Synthesis, Track
from tactbench.sensors.biotac.electrodes import ELECTRODES

SEEDS = 400
REST = Scene(name="a")


def _levels(sensor, seed, scene=REST, kind="taxel"):
    """What the effect adds to each channel of a kind."""
    channels = sensor.spec.channels(kind)
    track = Track(
        clock="", channels=channels, t_s=np.zeros(1), force_n=np.zeros(1), readings=np.zeros((1, len(channels))),
        quality=np.zeros((1, len(channels)), dtype=np.uint8),
    )  # fmt: skip
    run = Synthesis(
        sensor=handled(sensor, scene), scene=scene, seed=seed, t_s=np.zeros(1),
        load=Load(np.array([0.0, 1.0]), np.zeros(2)), tracks=(track,), contact=Contact(1.0, 0.0, 0.0),
        reference_n=np.zeros(1),
    )  # fmt: skip
    offset(run)
    return track.readings[0]


def _without_shared(sensor):
    taxel = sensor.spec.nuisances["taxel"]
    alone = taxel.model_copy(update={"offset_shared": taxel.offset_shared.model_copy(update={"value": 0.0})})
    spec = sensor.spec.model_copy(update={"nuisances": {**sensor.spec.nuisances, "taxel": alone}})
    return sensor.model_copy(update={"spec": spec})


@pytest.fixture(scope="module")
def own(sensors):
    """(seeds, electrodes) own offsets of the BioTac."""
    return np.array([_levels(_without_shared(sensors["biotac"]), seed) for seed in range(SEEDS)])


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


def test_independent_offsets_are_explained_by_the_coefficients_alone(sensors):
    scene = REST.model_copy(update={"simulation": Simulation(scenario="hard-handled")})
    rows = np.array([_levels(sensors["biotac"], seed, scene) for seed in range(SEEDS)])
    # 5 of 18 degrees of freedom: 0.278, as white noise shows on the real finger (0.28); uncertain by 0.006.
    assert _explained(rows) == pytest.approx(5 / 18, abs=0.024)


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
    np.testing.assert_allclose(basis.sum(axis=0), 0.0, atol=1e-12)
    # It holds every quadratic over the finger, and so nothing else.
    centred = _quadratics()[:, 1:] - _quadratics()[:, 1:].mean(axis=0)
    np.testing.assert_allclose(basis @ (basis.T @ centred), centred, rtol=0, atol=1e-10 * np.abs(centred).max())
    # Shifted and stretched along the finger, the quadratics are the same functions of the electrodes.
    channels = tuple(
        channel.model_copy(
            update={"position_m": (3.0 * channel.position_m[0] + 0.5, *channel.position_m[1:])}
            if channel.position_m
            else {}
        )
        for channel in spec.streams[0].channels
    )
    moved = spec.model_copy(update={"streams": (spec.streams[0].model_copy(update={"channels": channels}),)})
    other = smooth_basis(moved, "taxel")
    np.testing.assert_allclose(basis @ basis.T, other @ other.T, atol=1e-10)


def test_few_places_or_none_leave_fewer_fields_or_none(sensors):
    spec = sensors["biotac"].spec
    stream = spec.streams[0]

    def with_places(*places):
        channels = tuple(
            channel.model_copy(update={"position_m": place})
            for channel, place in zip(stream.channels, places, strict=False)
        )
        return spec.model_copy(update={"streams": (stream.model_copy(update={"channels": channels}),)})

    on_a_line = with_places(*((1e-3 * number, 0.0, -5e-3) for number in range(6)))
    assert smooth_basis(on_a_line, "taxel").shape == (6, 2)  # straight and bent
    assert smooth_basis(with_places((0.0, 0.0, -5e-3)), "taxel").shape == (1, 0)
    assert smooth_basis(with_places((0.0, 0.0, -5e-3), None), "taxel") is None
    assert smooth_basis(load_registry().sensors["ideal"].spec, "taxel").shape == (16, 5)
    lone = sensors["biotac"].model_copy(update={"spec": with_places((0.0, 0.0, -5e-3))})
    found = [_levels(_without_shared(lone), seed)[0] for seed in range(SEEDS)]
    # A single channel has no field: its whole offset is its own. 2 counts, uncertain by 3.5 %.
    assert np.std(found) == pytest.approx(2.0, rel=0.14)


def test_a_scenario_leaves_what_it_does_not_name_and_is_never_the_default(sensors):
    spec = sensors["biotac"].spec
    hard = spec.handled("hard-handled")
    assert spec.handled(None) is spec
    for kind, nuisances in spec.nuisances.items():
        if kind not in spec.scenarios["hard-handled"].nuisances:
            assert hard.nuisances[kind] == nuisances
    kept = ("white", "offset_session", "gain_scatter", "warm_up", "warm_up_tau", "warm_up_scatter", "creep", "step")
    for name in kept:
        assert getattr(hard.nuisances["taxel"], name) == getattr(spec.nuisances["taxel"], name)
    assert Scene(name="a").simulation.scenario is None
