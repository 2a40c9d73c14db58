"""What moves along the skin: laws that hold whatever the numbers."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.rigs.twin.contact.media import shear_shapes
from tactbench.rigs.twin.contact.press import Press, at_rest
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.contact.tangential import (
    dragged_state,
    pressed_state,
    sliding_stiffness,
    tangential_of,
    traction_shares,
)
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tests.oracles.layers import bonded_layer

YOUNG, SIDE_MM, MU = 1.0, 12.0, 0.6


def _layer(poisson, *, cells=64, thickness_mm=20.0):
    return bonded_layer(poisson, thickness_mm=thickness_mm, side_mm=SIDE_MM, cells=cells, penalty=1000.0)


@settings(max_examples=20)
@given(st.floats(0, 0.5), st.floats(0.5, 20), st.integers(0, 2**32 - 1))
def test_tractions_do_each_others_work(poisson, thickness_mm, seed):
    """Betti: what one traction does along another's displacement is what the other does along its own."""
    skin = _layer(poisson, cells=16, thickness_mm=thickness_mm)
    along, rng = tangential_of(skin, skin_grid(skin.sheet)), np.random.default_rng(seed)
    rest = at_rest(medium_of(skin, skin_grid(skin.sheet)))
    ways = [(math.cos(angle), math.sin(angle)) for angle in rng.uniform(0, 2 * math.pi, 2)]
    states = [dataclasses.replace(rest, pressure_mpa=rng.random((16, 16))) for _ in ways]
    moved = [along.dragged(state, way, rest.pressure_mpa > 0) for state, way in zip(states, ways, strict=True)]
    work = [
        float((np.multiply.outer(ways[one], states[one].pressure_mpa) * moved[other]).sum())
        for one, other in ((0, 1), (1, 0))
    ]
    own = float((np.multiply.outer(ways[0], states[0].pressure_mpa) * moved[0]).sum())
    assert work[0] == pytest.approx(work[1], rel=1e-10, abs=1e-10 * own)
    assert own > 0


def test_an_even_traction_shears_a_layer():
    skin = _layer(0.4, cells=16, thickness_mm=3.0)
    along, rest = tangential_of(skin, skin_grid(skin.sheet)), at_rest(medium_of(skin, skin_grid(skin.sheet)))
    even = dataclasses.replace(rest, pressure_mpa=np.full((16, 16), 0.1))
    moved = along.dragged(even, (0.6, -0.8), even.pressure_mpa > 0)
    by_h_over_g = 0.1 * 3.0 / (YOUNG / 2 / 1.4)
    np.testing.assert_allclose(moved[0], 0.6 * by_h_over_g, rtol=1e-12)
    np.testing.assert_allclose(moved[1], -0.8 * by_h_over_g, rtol=1e-12)


@pytest.mark.parametrize(("waves_x", "waves_s"), [(2, 0), (2, -1)])
def test_a_wave_of_traction_moves_a_layer_along_itself_and_along_its_crests(waves_x, waves_s):
    skin, grid = _layer(0.3, cells=16, thickness_mm=3.0), skin_grid(_layer(0.3, cells=16).sheet)
    k = 2 * math.pi / SIDE_MM * np.array([waves_x, waves_s])
    wave = np.cos(k[0] * grid.x_mm[:, None] + k[1] * grid.s_mm[None, :])
    state = dataclasses.replace(at_rest(medium_of(skin, grid)), pressure_mpa=wave)
    way, size, shear = np.array([0.6, -0.8]), float(np.hypot(*k)), YOUNG / 2 / 1.3
    _, along, across = (float(shape) / (shear * size) for shape in shear_shapes(np.array(size * 3.0), 0.3))
    ahead = k * (k @ way) / size**2
    moved = tangential_of(skin, grid).dragged(state, tuple(way), wave > 0)
    np.testing.assert_allclose(moved, np.multiply.outer(along * ahead + across * (way - ahead), wave), atol=1e-12)


@pytest.fixture(scope="module")
def presses(specs):
    """One skin of each kind, pressed with a cap."""
    made = {}
    layer = _layer(0.5, cells=48, thickness_mm=3.0)
    for name, skin in (("layer", layer), ("foam", specs["icub"].skin), ("shell", specs["biotac"].skin)):
        grid, sheet = skin_grid(skin.sheet), skin.sheet
        contact = Contact(10.0, float(grid.x_mm.mean()), 0.0)
        gap = gap_mm(grid, contact, sheet)
        made[name] = (Press(medium_of(skin, grid), gap, contact), tangential_of(skin, grid))
    return made


@pytest.mark.parametrize("name", ["layer", "foam", "shell"])
@settings(max_examples=12)
@given(
    since=st.floats(-0.5, 1), inner=st.sampled_from([0.0, 0.1, 0.5, 0.9, 1.0]), held=st.booleans(),
    angle=st.floats(0, 2 * math.pi), load=st.sampled_from([1.0, 3.0]),
)  # fmt: skip
def test_a_traction_adds_up_to_its_force_and_never_exceeds_friction(presses, name, since, inner, held, angle, load):
    press, along = presses[name]
    state, way = press(load), (math.cos(angle), math.sin(angle))
    # As Dragged has it: a share of what was left of the limit since the last slip, by Mindlin or held as the way goes.
    asked = (since + (1 - since) * (1 - inner ** (2 / 3) if held else 1 - inner)) * MU * load
    share, stuck, b = (
        float(one[0]) for one in traction_shares(*(np.array([v]) for v in (load, asked, inner ** (1 / 3))), MU)
    )
    by = (MU * (share + b * stuck), MU * b)
    dragged = dragged_state(state, press(inner * load), along, way, *by)
    area = float(np.prod(state.grid.cell_mm))
    # The solver balances forces to 1e-6 of the load, of both contacts.
    np.testing.assert_allclose(dragged.shear_mpa.sum((1, 2)) * area, asked * np.array(way), atol=3e-6 * load)
    assert np.all(np.hypot(*dragged.shear_mpa) <= MU * state.pressure_mpa * (1 + 1e-9))
    back = dragged_state(state, press(inner * load), along, (-way[0], -way[1]), *by)
    plain = pressed_state(state, along).tangential_displacement_mm
    np.testing.assert_allclose(back.shear_mpa, -dragged.shear_mpa, atol=1e-15)
    np.testing.assert_allclose(
        back.tangential_displacement_mm - plain, plain - dragged.tangential_displacement_mm, atol=1e-12
    )


@pytest.mark.parametrize("name", ["foam", "shell"])
def test_where_no_model_moves_the_surface_the_contact_moves_as_friction_says(presses, name):
    press, along = presses[name]
    state = press(1.0)
    moved = along.dragged(state, (0.0, 1.0), state.pressure_mpa > 0)
    stiffness = float(sliding_stiffness(np.array(state.contact_radius_mm), along._shear_mpa))
    assert not moved[0].any()
    if name == "foam":  # columns are pressed straight down
        assert not pressed_state(state, along).tangential_displacement_mm.any()
    np.testing.assert_allclose(moved[1], np.where(state.pressure_mpa > 0, 1.0 / stiffness, 0.0), rtol=1e-12)


@pytest.mark.parametrize("x_mm", [-4.0, 8.0])
def test_a_shells_membrane_is_in_balance_along_itself(specs, x_mm):
    """Donnell's membrane forces have no divergence: nothing pulls the sheet along itself, nor across its mirrors."""
    skin = specs["biotac"].skin
    grid = skin_grid(skin.sheet)
    bell = np.exp(-((grid.x_mm[:, None] - x_mm) ** 2 + grid.s_mm[None, :] ** 2) / 2 / 2.0**2)
    bell -= bell.mean()
    deflection = np.concatenate([bell, bell[::-1]])
    dx, ds = grid.cell_mm
    kx = 2 * np.pi * np.fft.fftfreq(len(deflection), dx)[:, None]
    ks = 2 * np.pi * np.fft.fftfreq(grid.s_mm.size, ds)[None, :]

    def along_x(field):
        return np.real(np.fft.ifft2(1j * kx * np.fft.fft2(field)))

    def along_s(field):
        return np.real(np.fft.ifft2(1j * ks * np.fft.fft2(field)))

    rest = at_rest(medium_of(skin, grid))
    own_u, own_v = tangential_of(skin, grid).pressed(dataclasses.replace(rest, deflection_mm=bell))
    moved = np.concatenate([own_u, -own_u[::-1]]), np.concatenate([own_v, own_v[::-1]])
    half, nu = skin.thickness.to("mm") / 2, skin.poisson.to("1")
    u, v = moved[0] - half * along_x(deflection), moved[1] - half * along_s(deflection)
    hoop = along_s(v) - deflection / skin.mid_radius.to("mm")
    n_x, n_s, n_xs = along_x(u) + nu * hoop, hoop + nu * along_x(u), (1 - nu) / 2 * (along_s(u) + along_x(v))
    scale = np.abs(along_s(n_s)).max()
    # A bell of 2 mm has nothing left at the waves of two cells, which the grid cannot tell apart: e^-40.
    assert np.abs(along_x(n_x) + along_s(n_xs)).max() < 1e-9 * scale
    assert np.abs(along_x(n_xs) + along_s(n_s)).max() < 1e-9 * scale
