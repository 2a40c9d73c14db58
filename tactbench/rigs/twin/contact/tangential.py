"""Tangential displacement of a skin's outer surface under pressure and under traction.

The displacement is linear in pressure and traction. A traction's effect on the surface's height, and so on the
pressure, is neglected, as in Cattaneo's and Mindlin's contacts: exact for short waves in an incompressible layer.

Partial slip follows the closed forms of Cattaneo (1938) and Mindlin (1949). A contact pressed by P and pushed along by
Q < mu P sticks inside the radius c and slips in the annulus outside it. Formulas as in Johnson, Contact Mechanics
(1985), section 7.2, for a rigid body on a half-space: ``1/G* = (2 - nu)/G``. A skin is a layer: on a rigid base it is
stiffer than the half-space once the contact is wider than the layer is thick, over a fluid it can also stretch as a
sheet and is softer (see ``docs/effects.md``).

The change of the readings of one contact by a tangential force is tabulated over both forces. The traction of a contact
pressed by P that carries Q along a slide is, after Cattaneo and Mindlin in the general form of Ciavarella (1998) and
Jaeger (1998), the difference of two contacts without friction:

    q = A p(P) - B p(P*),    P* = (c/a)³ P the load inside the part that sticks,    A P - B P* = Q

A = B = mu after a first push; a contact that slips as a whole has B = 0. A push after a slip lies between the two:
``q = Q/P p(P) + b mu [(P*/P) p(P) - p(P*)]`` with b from 0 to 1, a share of the pressure plus b times the rest of a
first push's traction. The readings are composed likewise: exactly for b = 0 and b = 1, and for every b if they are
linear in traction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, FoamPad, Skin, SkinGrid, SkinState
from tactbench.rigs.twin.contact.load_table import Interpolant, LoadTable
from tactbench.rigs.twin.contact.media import shear_shapes
from tactbench.rigs.twin.contact.press import AnyPress

Direction = tuple[float, float]
"""Direction of a slide on the skin: the components of a unit vector along x and s."""
_SHARES = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
"""Shares of mu P carried by a traction proportional to the pressure; a share of 0 changes nothing."""
_PUSHES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
"""Shares of mu P carried after a first push; for 0 and 1 this traction, too, is proportional to the pressure."""


def shear_modulus_mpa(skin: Skin) -> float:
    """Return the skin's effective shear modulus ``G* = G/(2 - nu)`` [MPa].

    A foam has its own G and nu = 0 (its lateral contraction is neglected in ``contact`` too).
    """
    if isinstance(skin, FoamPad):
        return skin.shear.to("MPa") / 2.0
    poisson = skin.poisson.to("1")
    return skin.young.to("MPa") / (2.0 * (1.0 + poisson)) / (2.0 - poisson)


def sliding_stiffness(contact_radius_mm: FloatArray, shear_mpa: float) -> FloatArray:
    """Return ``16 a G*/3`` [N/mm]: tangential force over displacement of a contact in full slip (Johnson 7.42).

    The formula holds for any force if tractions are proportional to the pressure, as in full slip; a contact that
    sticks everywhere is stiffer by half, ``8 a G*`` (Johnson 7.44).
    """
    return 16.0 / 3.0 * contact_radius_mm * shear_mpa


def share_of_force(travelled: FloatArray) -> FloatArray:
    """Return the share of the force needed for full slip, from the share s of the displacement: ``1 - (1 - s)^(3/2)``.

    This is Johnson 7.42 solved for the force. Both shares count from the last state with tractions proportional to the
    pressure, at rest or at the end of a slip: Cattaneo's argument holds from either.
    """
    return 1.0 - (1.0 - np.clip(travelled, 0.0, 1.0)) ** 1.5


def stick_ratio(travelled: FloatArray) -> FloatArray:
    """Return c/a from the share s of full slip's displacement: ``(1 - Q/mu P)^(1/3) = sqrt(1 - s)`` (Johnson 7.39)."""
    return np.sqrt(1.0 - np.clip(travelled, 0.0, 1.0))


class TangentialResponse:
    """Tangential response of a skin; by default the contact moves as a whole and the skin around it stays.

    The contact's displacement is the tangential force over the stiffness of a half-space, as for `friction`. A normal
    force moves nothing along the skin, as in a foam of independent columns.
    """

    def __init__(self, skin: Skin) -> None:
        self._shear_mpa = shear_modulus_mpa(skin)

    def pressed(self, state: SkinState) -> FloatArray:
        """Return the (2, nx, ns) displacement [mm] of a pressed skin without friction."""
        return np.zeros((2, *state.pressure_mpa.shape))

    def dragged(self, state: SkinState, direction: Direction, touched: npt.NDArray[np.bool_]) -> FloatArray:
        """Return the displacement (2, nx, ns) along x and s [mm] under a shear traction as large as the pressure.

        `touched` (nx, ns) is the whole contact; `state` may hold only the pressure of its inner part.
        """
        if not state.force_n > 0:
            return np.zeros((2, *touched.shape))
        stiffness = sliding_stiffness(np.array(state.contact_radius_mm), self._shear_mpa)
        return np.asarray(np.multiply.outer(np.array(direction), state.force_n / stiffness * touched))


def tangential_of(skin: Skin, grid: SkinGrid) -> TangentialResponse:
    """Return the tangential response of `skin`."""
    if isinstance(skin, BondedLayer):
        return _Layer(skin, grid)
    return _Shell(skin, grid) if isinstance(skin, FluidBackedShell) else TangentialResponse(skin)


def pressed_state(state: SkinState, along: TangentialResponse | None) -> SkinState:
    """Return `state` with the tangential displacement of a frictionless press, and no traction.

    Without a tangential response (`along` is None) the displacement is zero.
    """
    moved = np.zeros((2, *state.pressure_mpa.shape)) if along is None else along.pressed(state)
    return replace(state, tangential_displacement_mm=moved, shear_mpa=np.zeros_like(moved))


class _Spectral:
    """Fourier transforms of a periodic sheet, or of a sheet mirrored at its ends along x: half of a periodic one."""

    def __init__(self, grid: SkinGrid, *, mirrored: bool = False) -> None:
        self._mirrored, self._cells = mirrored, grid.x_mm.size
        nx, ns = self._shape = (self._cells * (1 + mirrored), grid.s_mm.size)
        dx, ds = grid.cell_mm
        kx, ks = 2 * np.pi * np.stack(np.meshgrid(np.fft.fftfreq(nx, dx), np.fft.rfftfreq(ns, ds), indexing="ij"))
        self.k2 = kx**2 + ks**2
        self.k2[0, 0] = 1.0
        # A wave of two cells has no slope on the grid: odd operators leave it out.
        if nx % 2 == 0:
            kx[nx // 2] = 0.0
        if ns % 2 == 0:
            ks[:, -1] = 0.0
        self.slope = 1j * np.stack([kx, ks])
        """(2, nx, ns//2+1) derivatives along x and s."""

    def filtered(self, field: FloatArray, multiplier: npt.NDArray[np.complex128]) -> FloatArray:
        """Return the (2, nx, ns) fields whose modes are those of (nx, ns) `field` times (2, nx, ns//2+1) factors."""
        whole = np.concatenate([field, field[::-1]]) if self._mirrored else field
        return np.fft.irfft2(np.fft.rfft2(whole) * multiplier, self._shape)[:, : self._cells]


class _Shell(TangentialResponse):
    """The shallow shell's own membrane displacements, and the turn of its normal at the outer face.

    Donnell: ``k⁴ u = i kx (ks² - nu kx²) w / R``, ``k⁴ v = -i ks (ks² + (2 + nu) kx²) w / R`` for a deflection w
    towards the core; the outer face moves by ``t/2 grad w`` more. The clamp does not act in the sheet's own plane.
    """

    def __init__(self, skin: FluidBackedShell, grid: SkinGrid) -> None:
        super().__init__(skin)
        self._waves = _Spectral(grid, mirrored=skin.sheet.dome is not None)
        (along, across), k4 = self._waves.slope, self._waves.k2**2
        kx2, ks2, poisson = np.abs(along) ** 2, np.abs(across) ** 2, skin.poisson.to("1")
        membrane = np.stack([along * (ks2 - poisson * kx2), -across * (ks2 + (2 + poisson) * kx2)])
        half_mm = skin.thickness.to("mm") / 2
        self._moved = membrane / (skin.mid_radius.to("mm") * k4) + half_mm * self._waves.slope

    def pressed(self, state: SkinState) -> FloatArray:
        return self._waves.filtered(state.deflection_mm, self._moved)


class _Layer(TangentialResponse):
    """Tangential response of a layer bonded to a rigid base: a closed form for each wave (:func:`shear_shapes`)."""

    def __init__(self, skin: BondedLayer, grid: SkinGrid) -> None:
        young, poisson, thickness = skin.young.to("MPa"), skin.poisson.to("1"), skin.thickness.to("mm")
        self._waves = _Spectral(grid)
        k, shear = np.sqrt(self._waves.k2), young / (2 * (1 + poisson))
        squeezed, along, across = (shape / (shear * k) for shape in shear_shapes(k * thickness, poisson))
        self._squeezed = self._waves.slope * (squeezed / k)
        # ``across`` for every direction, and what a wave along the traction adds: the tensor (along - across) k k / k².
        self._more = (along - across) / self._waves.k2
        across[0, 0], self._more[0, 0] = thickness / shear, 0.0
        self._across = across

    def pressed(self, state: SkinState) -> FloatArray:
        return self._waves.filtered(state.pressure_mpa, self._squeezed)

    def dragged(self, state: SkinState, direction: Direction, touched: npt.NDArray[np.bool_]) -> FloatArray:
        slope, way = self._waves.slope, np.array(direction)[:, None, None]
        answer = self._across * way - self._more * slope * (slope * way).sum(axis=0)
        return self._waves.filtered(state.pressure_mpa, answer)


def traction_shares(
    force_n: FloatArray, tangential_n: FloatArray, stick_ratio: FloatArray, friction: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Q/(mu P), P*/P and b at (n,) moments.

    b is bounded such that no traction exceeds mu times the pressure.
    """
    limit = friction * force_n
    share = np.clip(np.divide(tangential_n, limit, out=np.zeros_like(limit), where=limit > 0), -1.0, 1.0)
    inner = np.where(limit > 0, stick_ratio, 0.0) ** 3
    b = np.divide(1.0 - share, inner, out=np.zeros_like(share), where=inner > 0)
    return share, inner, np.minimum(b, 1.0)


def dragged_state(
    state: SkinState,
    inner: SkinState,
    along: TangentialResponse,
    direction: Direction,
    outer_by: float,
    inner_by: float,
) -> SkinState:
    """Return `state` with the traction ``outer_by p(state) - inner_by p(inner)`` in `direction` and its displacement.

    Where more load has lowered the pressure (in a shell's dent, at a cover's edge), the inner pressure is limited to
    the lower one and scaled elsewhere to keep its force: friction cannot hold a place without pressure.
    """
    touched, inner_mpa = state.pressure_mpa > 0, np.minimum(inner.pressure_mpa, state.pressure_mpa)
    if inner_mpa.any():
        inner = replace(inner, pressure_mpa=inner_mpa * (inner.pressure_mpa.sum() / inner_mpa.sum()))
    shear = np.multiply.outer(np.array(direction), outer_by * state.pressure_mpa - inner_by * inner.pressure_mpa)
    moved = along.pressed(state) + outer_by * along.dragged(state, direction, touched)
    if inner_by:
        moved -= inner_by * along.dragged(inner, direction, touched)
    return replace(state, tangential_displacement_mm=moved, shear_mpa=shear)


@dataclass(frozen=True)
class SlideTable:
    """Change of the readings by a slide in one direction over one surface."""

    friction: float
    """Static friction coefficient mu."""
    proportional: Interpolant
    """(m,) loads -> (m, shares * channels) changes of the readings by a traction proportional to the pressure."""
    partial: Interpolant
    """(m,) loads -> (m, pushes * channels) readings after a first push, less those under a proportional traction."""

    def __call__(
        self, force_n: FloatArray, load_n: FloatArray, tangential_n: FloatArray, stick_ratio: FloatArray
    ) -> FloatArray:
        """Return the (n, channels) change of the readings.

        The response follows `force_n` (n,), the true normal force `load_n` or one that lags behind it. `stick_ratio` is
        the radius of the part that sticks over that of the contact; 0 where everything slips.
        """
        share, inner, b = traction_shares(load_n, tangential_n, stick_ratio, self.friction)
        at = np.clip(force_n, 0.0, self.proportional.loads[-1])
        added = _between(_SHARES, self.proportional(at), share)
        return added + b[:, None] * _between(_PUSHES, self.partial(at), 1.0 - inner)


def build_slide_table(
    press: AnyPress,
    read: Callable[[SkinState], FloatArray],
    table: LoadTable,
    skin: Skin,
    direction: Direction,
    friction: float,
) -> SlideTable:
    """Return the slide table at the loads of `table`, a load table made with the same `press` and `read`."""
    along = tangential_of(skin, press.medium.grid)
    proportional, partial = [], []
    for load, plain in zip(table.loads_n.tolist(), table.readings, strict=True):
        state = press(load)

        def added(inner: SkinState, outer_by: float, inner_by: float, state: SkinState = state) -> FloatArray:
            return read(dragged_state(state, inner, along, direction, friction * outer_by, friction * inner_by))

        even = {push: added(state, push, 0.0) - plain for push in {*_SHARES.tolist(), *_PUSHES.tolist()}}
        first = {push: added(press((1.0 - push) * load), 1.0, 1.0) - plain for push in _PUSHES.tolist()}
        proportional.append(np.concatenate([even[push] for push in _SHARES.tolist()]))
        partial.append(np.concatenate([first[push] - even[push] for push in _PUSHES.tolist()]))
    loads = table.loads_n.tolist()
    return SlideTable(friction, *(Interpolant(loads, one, table.touch_down_n) for one in (proportional, partial)))


def _between(nodes: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Return (n, channels): the polynomial through (n, nodes * channels) `values` at (n,) `at` (Lagrange)."""
    weights = np.ones((at.size, nodes.size))
    for i, node in enumerate(nodes):
        for other in np.delete(nodes, i):
            weights[:, i] *= (at - other) / (node - other)
    return np.asarray(np.einsum("ni,nic->nc", weights, values.reshape(at.size, nodes.size, -1)))
