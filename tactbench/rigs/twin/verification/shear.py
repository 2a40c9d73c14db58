"""Checks of what a skin does along itself: pressed without friction, and pushed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactbench.plugin import assumed
from tactbench.plugin.simulation import BondedLayer, SkinSheet, Verdict
from tactbench.rigs.twin.closed_forms.half_space import Hertz
from tactbench.rigs.twin.closed_forms.tangential import CattaneoMindlin
from tactbench.rigs.twin.contact.press import Press, at_rest
from tactbench.rigs.twin.contact.skins import medium_of
from tactbench.rigs.twin.contact.slide_table import dragged_state
from tactbench.rigs.twin.contact.tangential import tangential_of
from tactbench.rigs.twin.geometry import Contact, skin_grid
from tactbench.rigs.twin.verification.pressing import order, paraboloid_mm, within

_SIDE_MM, _THICK_MM, _RADIUS_MM, _FORCE_N, _FRICTION = 12.0, 20.0, 5.0, 0.3, 0.6


def boussinesq() -> Sequence[Verdict]:
    """Hold a thick layer under Hertz's pressure against the half-space's radial displacement."""
    cells = [48, 96, 192]
    errors = [_off(0.3, each) for each in cells]
    return [
        within(
            "compressible: largest difference within two contact radii, of the largest displacement",
            errors[-1],
            0.25 / 15,
            source="Johnson 1985, 3.41b; bound: a quarter of a cell over the contact's radius, whose edge is in steps",
        ),
        Verdict("compressible: order of its convergence", order(cells, errors), 1.0, 2.5, source="an edge in steps"),
        within(
            "incompressible: largest displacement, of a compressible one's",
            _off(0.5, 96),
            1e-5,
            source="0 by Boussinesq; bound: the longest waves of the sheet feel the base by q² e^-2q, 4e-7 relative",
        ),
    ]


def cattaneo() -> Sequence[Verdict]:
    """Hold the default solver's cap, pushed along, against Cattaneo's and Mindlin's."""
    skin = _layer(0.5, 64)
    grid, gap = skin_grid(skin.sheet), paraboloid_mm(64, _SIDE_MM, radius_mm=_RADIUS_MM)
    press, along = Press(medium_of(skin, grid), gap, Contact(_RADIUS_MM, 0.0, 0.0)), tangential_of(skin, grid)
    state, r = press(_FORCE_N), np.hypot(grid.x_mm[:, None], grid.s_mm[None, :])
    closed = CattaneoMindlin(_FRICTION, state.contact_radius_mm, _FORCE_N, 4 / 3 / 1.5)
    within_contact, peak = r < state.contact_radius_mm, _FRICTION * float(state.pressure_mpa.max())
    verdicts = []
    for share in (0.3, 0.6, 0.9):
        push = share * _FRICTION * _FORCE_N
        pushed = dragged_state(state, press((1 - share) * _FORCE_N), along, (1.0, 0.0), _FRICTION, _FRICTION)
        moved, shear = pushed.tangential_displacement_mm, pushed.shear_mpa
        assert moved is not None
        assert shear is not None
        off = float(np.sqrt(np.mean(np.square(shear[0] - closed.traction_mpa(push, r))[within_contact])))
        stuck, shift = r < 0.8 * closed.stick_radius_mm(push), closed.shift_mm(push)
        verdicts += [
            within(
                f"traction at {share:.0%} of slip, rms, of the largest friction",
                off / peak,
                0.05,
                source="Johnson 1985, section 7.2; bound: cells of a fifth of the contact's radius, two edges in steps",
            ),
            within(
                f"where it sticks at {share:.0%}, how differently it moves, of the shift",
                float(max(np.ptp(moved[0][stuck]), np.abs(moved[1][stuck]).max())) / shift,
                0.02,
                source="what sticks to a rigid cap moves as one; bound: the same edges",
            ),
        ]
    return verdicts


def _layer(poisson: float, cells: int) -> BondedLayer:
    why = "a check"
    half, arc = assumed(_SIDE_MM / 2, "mm", why), assumed(_SIDE_MM, "mm", why)
    sheet = SkinSheet(x_min=assumed(-_SIDE_MM / 2, "mm", why), x_max=half, arc=arc, cells=(cells, cells))
    return BondedLayer(
        sheet=sheet,
        young=assumed(1.0, "MPa", why),
        poisson=assumed(poisson, "1", why),
        thickness=assumed(_THICK_MM, "mm", why),
        contact_stiffness=assumed(1000.0, "MPa/mm", why),
    )


def _off(poisson: float, cells: int) -> float:
    """Return how far a thick layer is from the half-space, of the largest displacement at nu = 0.3."""
    skin = _layer(poisson, cells)
    rest, body = at_rest(medium_of(skin, skin_grid(skin.sheet))), Hertz(_RADIUS_MM, 1 / (1 - poisson**2))
    x, s = np.meshgrid(rest.grid.x_mm, rest.grid.s_mm, indexing="ij")
    r = np.hypot(x, s)
    pressed = replace(rest, pressure_mpa=body.pressure_mpa(_FORCE_N, r), force_n=_FORCE_N)
    moved = tangential_of(skin, rest.grid).pressed(pressed)
    # The pressed half-space shrinks along itself, by (1-2nu) p / 2G of its area; the mean of a periodic sheet cannot,
    # so that the rest of it stretches evenly.
    stretched = (1 - 2 * poisson) * (1 + poisson) / 2 * _FORCE_N / _SIDE_MM**2 * r
    outwards = (moved[0] * x + moved[1] * s) / r - stretched
    off = np.abs(outwards - body.radial_mm(_FORCE_N, r, poisson))
    largest = np.abs(Hertz(_RADIUS_MM, 1 / 0.91).radial_mm(_FORCE_N, r, 0.3)).max()
    return float(off[r < 2 * body.contact_radius_mm(_FORCE_N)].max() / largest)
