"""Tangential displacement of a skin's outer surface under pressure and under traction.

The displacement is linear in pressure and traction. A traction's effect on the surface's height, and so on the
pressure, is neglected, as in Cattaneo's and Mindlin's contacts: exact for short waves in an incompressible layer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, Skin, SkinGrid, SkinState
from tactbench.rigs.twin.contact.layer import shear_shapes
from tactbench.rigs.twin.partial_slip import shear_modulus_mpa, sliding_stiffness

Direction = tuple[float, float]
"""Direction of a slide on the skin: the components of a unit vector along x and s."""


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
        """Return the (2, nx, ns) displacement [mm] under a traction of the size of the contact pressure.

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
