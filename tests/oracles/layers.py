"""Flat bonded layers for the product's own solver."""

from __future__ import annotations

from tactbench.plugin import assumed
from tactbench.plugin.simulation import BondedLayer, SkinSheet


def bonded_layer(
    poisson: float,
    *,
    young_mpa: float = 1.0,
    thickness_mm: float = 2.0,
    side_mm: float = 24.0,
    cells: int = 96,
    penalty: float = 300.0,
) -> BondedLayer:
    """Return a layer on a square sheet around zero."""
    why = "test"
    half, arc = assumed(side_mm / 2, "mm", why), assumed(side_mm, "mm", why)
    return BondedLayer(
        sheet=SkinSheet(x_min=assumed(-side_mm / 2, "mm", why), x_max=half, arc=arc, cells=(cells, cells)),
        young=assumed(young_mpa, "MPa", why),
        poisson=assumed(poisson, "1", why),
        thickness=assumed(thickness_mm, "mm", why),
        contact_stiffness=assumed(penalty, "MPa/mm", why),
    )
