"""What a sensor's skin is made of: a declaration, not a solver.

A third party's sensor runs on the twin by declaring one of these media. The equations are in ``docs/twin.md``.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tactbench.core.spec.quantity import Frozen, Quantity


class Dome(Frozen):
    """A finger's tip: where its cylinder ends in a dome of the same radius."""

    start: Quantity
    """Axial coordinate of the sheet at which the dome begins; towards positive x [length]."""
    arc_per_radian: Quantity
    """Length of the sheet for one radian of the dome's meridian [length]."""


class SkinSheet(Frozen):
    """The unrolled skin: a rectangle, axial coordinate x by arc length s, s = 0 on the midline."""

    x_min: Quantity
    """Axial lower end [length]."""
    x_max: Quantity
    """Axial upper end [length]; towards the tip of a finger."""
    arc: Quantity
    """Width of the sheet along the surface [length], centred on s = 0."""
    outer_radius: Quantity | None = None
    """Radius of the finger's outer surface [length]; None for a flat pad."""
    dome: Dome | None = None
    """The tip, where the finger ends in one; None: a cylinder (or a flat pad) throughout."""
    cells: tuple[int, int] = (48, 64)
    """Default grid, axial x arc."""
    pad: tuple[Quantity, Quantity, Quantity] | None = None
    """Active part (x_min, x_max, arc) inside soft margins; None: the whole sheet is active."""


class FluidBackedShell(Frozen):
    """An elastic sleeve around an incompressible fluid film over a rigid core."""

    medium: Literal["fluid-backed shell"] = "fluid-backed shell"
    sheet: SkinSheet
    young: Quantity
    poisson: Quantity
    thickness: Quantity
    mid_radius: Quantity
    """Radius of the shell's middle surface [length]."""
    tension: Quantity
    """Membrane tension [force / length]."""
    contact_stiffness: Quantity
    """Through-thickness stiffness of the skin under an indenter [pressure / length]."""
    core_stiffness: Quantity
    """Penalty of the core once the film is closed [pressure / length]."""
    gap: Quantity
    """Film thickness at rest under the pad [length]."""
    gap_side: Quantity
    """Film thickness at rest at the sides [length]."""
    gap_side_fraction: Quantity
    """How much of the gap is lost at the sides before `gap_side` holds [1]."""
    residual_film: Quantity
    """Film that asperities keep open at touch-down [length]."""
    clamp_stiffness: Quantity
    """Soft clamp at the sleeve's ends and seam [pressure / length]."""
    clamp_length: Quantity
    """Decay length of that clamp [length]."""


class FoamPad(Frozen):
    """A compressible foam under a thin cover, on a rigid base."""

    medium: Literal["foam pad"] = "foam pad"
    sheet: SkinSheet
    young: Quantity
    """Oedometric modulus of the foam [pressure]."""
    shear: Quantity
    """Shear modulus of the foam [pressure]."""
    thickness: Quantity
    densification: Quantity
    """Strain at which the foam is solid [1]."""
    cover_tension: Quantity
    cover_bending: Quantity
    """Bending stiffness of the cover [force x length]."""
    contact_stiffness: Quantity
    """Stiff penalty, not a material value [pressure / length]."""


class BondedLayer(Frozen):
    """A linear elastic layer bonded to a rigid base, frictionless on top."""

    medium: Literal["bonded layer"] = "bonded layer"
    sheet: SkinSheet
    young: Quantity
    poisson: Quantity
    thickness: Quantity
    contact_stiffness: Quantity
    """Stiff penalty, not a material value [pressure / length]."""


Skin = Annotated[FluidBackedShell | FoamPad | BondedLayer, Field(discriminator="medium")]
"""Any of the media the twin can press."""
