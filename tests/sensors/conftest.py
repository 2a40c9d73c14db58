"""Skin states without a contact solver: smooth dents whose volume is pushed elsewhere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tactbench.plugin import FloatArray, SensorSpec
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, FoamPad, SkinGrid, SkinState


def grid_of(spec: SensorSpec, factor: float = 1.0) -> SkinGrid:
    assert spec.skin is not None
    sheet = spec.skin.sheet
    nx, ns = (round(n * factor) for n in sheet.cells)
    low, high, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    return SkinGrid(
        x_mm=low + (np.arange(nx) + 0.5) * (high - low) / nx,
        s_mm=-arc / 2 + (np.arange(ns) + 0.5) * arc / ns,
    )


def state_of(spec: SensorSpec, grid: SkinGrid, deflection: FloatArray, **facts: object) -> SkinState:
    skin = spec.skin
    match skin:
        case FluidBackedShell():
            least = skin.residual_film.to("mm")
            assert skin.sheet.outer_radius is not None
            rest = np.maximum(skin.film.at(grid.x_mm, grid.s_mm / skin.sheet.outer_radius.to("mm")), least)
            left = np.maximum(rest - deflection, least)
        case FoamPad() | BondedLayer():
            left = skin.thickness.to("mm") - deflection
        case None:
            raise AssertionError("no skin")
    given: dict[str, object] = {
        "grid": grid, "force_n": 1.0, "deflection_mm": deflection, "pressure_mpa": np.zeros_like(deflection),
        "thickness_mm": left, "depth_mm": 0.0, "fluid_pressure_mpa": 0.0, "contact_radius_mm": 0.0, "residual": 0.0,
    }  # fmt: skip
    return SkinState(**{**given, **facts})  # type: ignore[arg-type]


def dent(
    grid: SkinGrid, depth: float, x: float, s: float, width: float = 2.0, *, keep_volume: bool = True
) -> FloatArray:
    r2 = (grid.x_mm[:, None] - x) ** 2 + (grid.s_mm[None, :] - s) ** 2
    hollow = depth * np.exp(-r2 / (2 * width**2))
    return hollow - hollow.mean() if keep_volume else hollow


@pytest.fixture
def make_grid() -> Callable[..., SkinGrid]:
    return grid_of


@pytest.fixture
def make_state() -> Callable[..., SkinState]:
    return state_of


@pytest.fixture
def make_dent() -> Callable[..., FloatArray]:
    return dent
