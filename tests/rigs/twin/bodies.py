"""Skins and presses that several tests use."""

import math
from dataclasses import replace

import numpy as np

from tactbench.core.plugins.registry import load_registry
from tactbench.plugin import BondedLayer, Quantity, SkinSheet, assumed
from tactbench.rigs.twin.contact.newton import Press
from tactbench.rigs.twin.contact.skins import medium_of
from tactbench.rigs.twin.geometry import Touch, gap_mm

SENSORS = load_registry().sensors
BIOTAC = SENSORS["biotac"].spec.skin
ICUB = SENSORS["icub"].spec.skin


def q(value: float, unit: str) -> Quantity:
    return assumed(value, unit, "for a test")


def layer_skin(nu: float, h: float = 2.0, side: float = 24.0, cells: int = 128, penalty: float = 2000.0) -> BondedLayer:
    sheet = SkinSheet(x_min=q(-side / 2, "mm"), x_max=q(side / 2, "mm"), arc=q(side, "mm"), cells=(cells, cells))
    return BondedLayer(
        sheet=sheet, young=q(1.0, "MPa"), poisson=q(nu, "1"), thickness=q(h, "mm"),
        contact_stiffness=q(penalty, "MPa/mm"),
    )  # fmt: skip


def press(skin, radius=math.inf, x=0.0, s=0.0, cells=None, tilt=(0.0, 0.0)) -> Press:
    medium = medium_of(skin, cells)
    return Press(medium, gap_mm(medium.grid, Touch(radius, x, s, *tilt), medium.outer_radius_mm))


def scaled(skin, factor: float):
    """Return `skin` with every modulus and stiffness times `factor`."""
    stiff = ("young", "shear", "tension", "cover_tension", "cover_bending", "contact_stiffness", "core_stiffness",
             "clamp_stiffness")  # fmt: skip
    change = {
        name: q(getattr(skin, name).value * factor, getattr(skin, name).unit) for name in stiff if hasattr(skin, name)
    }
    return skin.model_copy(update=change)


def with_clamp_from_first_cell(one: Press) -> Press:
    """Return the press with the end clamps measured from the first and last cell centre, not from the edge."""
    medium = one.medium
    skin, grid = BIOTAC, medium.grid
    length, strength = skin.clamp_length.to("mm"), skin.clamp_stiffness.to("MPa/mm")
    x = grid.x_mm[:, None]
    ends = np.maximum(np.exp(-(x - grid.x_mm[0]) / length), np.exp(-(grid.x_mm[-1] - x) / length))
    seam = np.exp(-(skin.sheet.arc.to("mm") / 2 - np.abs(grid.s_mm[None, :])) / length)
    law = replace(medium.law, clamp=strength * (ends + seam))
    return Press(replace(medium, law=law), one.gap)
