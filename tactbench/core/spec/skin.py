"""Materials of a sensor's skin, as input of the simulation ``twin``; ``docs/twin.md`` has the equations."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from tactbench.core.spec.quantity import BendingStiffness, Frozen, Length, Pressure, Share, Source, Stiffness, Tension

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


class Dome(Frozen):
    """The tip of a finger, where its cylinder ends in a hemisphere of equal radius.

    A point of the dome keeps its axial coordinate on the sheet, which preserves areas (Lambert's cylindrical
    projection), and so loads and volumes.
    """

    start: Length
    """Axial coordinate at which the dome begins; the dome extends towards positive x [length]."""


class SheetTable(Frozen):
    """A table of lengths over the sheet, symmetric about its midline: a film's thickness, or a surface's depth.

    Lengths are linear between entries and constant beyond the outermost entries.
    """

    x_mm: tuple[float, ...]
    """Axial coordinates of the rows, ascending [mm]."""
    angle_deg: tuple[float, ...]
    """Angles of the columns around the finger from its midline, ascending [deg]."""
    value_mm: tuple[tuple[float, ...], ...]
    """Lengths, with one row for each of `x_mm` and one column for each of `angle_deg`."""
    source: Source

    @model_validator(mode="after")
    def _is_a_table(self) -> SheetTable:
        shape = {len(self.angle_deg)} == {len(row) for row in self.value_mm}
        ascending = all(a < b for axis in (self.x_mm, self.angle_deg) for a, b in itertools.pairwise(axis))
        if not (shape and self.x_mm and len(self.value_mm) == len(self.x_mm) and ascending):
            raise ValueError("a table of lengths needs ascending x_mm and angle_deg, and one length for each pair")
        return self

    @property
    def least_mm(self) -> float:
        """Smallest length in the table."""
        return min(map(min, self.value_mm))

    @property
    def most_mm(self) -> float:
        """Largest length [mm] in this table of lengths over the skin."""
        return max(map(max, self.value_mm))

    def at(self, x_mm: npt.NDArray[np.float64], angle_rad: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the lengths, (nx, ns) [mm], at (nx,) axial coordinates [mm] and (ns,) angles from the midline."""
        import numpy as np

        rows, angle = np.array(self.value_mm), np.abs(np.degrees(angle_rad))
        around = np.stack([np.interp(angle, self.angle_deg, row) for row in rows])
        place = np.interp(x_mm, self.x_mm, np.arange(rows.shape[0], dtype=np.float64))
        low = np.minimum(place.astype(np.intp), rows.shape[0] - 2)
        share = (place - low)[:, None]
        above = np.minimum(low + 1, rows.shape[0] - 1)
        found: npt.NDArray[np.float64] = (1.0 - share) * around[low] + share * around[above]
        return found


class SkinSheet(Frozen):
    """The unrolled skin, a rectangle of axial coordinate x and arc length s, with s = 0 on the midline."""

    x_min: Length
    """Lower end of the sheet's axial coordinate [length]."""
    x_max: Length
    """Upper end of the sheet's axial coordinate [length]; on a finger, the end at the tip."""
    arc: Length
    """Width of the sheet along the surface [length], centred on s = 0."""
    outer_radius: Length | None = None
    """Radius of the finger's outer surface [length]; None: the skin is a flat pad."""
    dome: Dome | None = None
    """Dome at the tip of the finger; None: the skin is a cylinder or a flat pad."""
    relief: SheetTable | None = None
    """Depth of the finger's unloaded surface below the cylinder and dome; None: the surface lies on them."""
    cells: tuple[int, int] = (48, 64)
    """Default numbers of grid cells, (axial, arc)."""
    pad: tuple[Length, Length, Length] | None = None
    """Active part (x_min, x_max, arc) within soft, insensitive margins; None: the whole sheet is active."""


class FluidBackedShell(Frozen):
    """An elastic sleeve around an incompressible fluid film over a rigid core."""

    medium: Literal["fluid-backed shell"] = "fluid-backed shell"
    sheet: SkinSheet
    young: Pressure
    """Young's modulus of the elastic sleeve [pressure]."""
    poisson: Share
    """Poisson's ratio of the sleeve, 0 to 0.5 [1]."""
    thickness: Length
    """Thickness of the sleeve in its unloaded state [length]."""
    mid_radius: Length
    """Radius of the shell's middle surface [length]."""
    tension: Tension
    """Membrane tension of the sleeve [force / length]."""
    contact_stiffness: Stiffness
    """Through-thickness stiffness of the skin under an indenter [pressure / length]."""
    core_stiffness: Stiffness
    """Penalty stiffness of the core after the film is used up [pressure / length]."""
    film: SheetTable
    """Thickness of the unloaded fluid film."""
    residual_film: Length
    """Film thickness that surface roughness keeps open when the sleeve touches the core [length]."""
    clamp_stiffness: Stiffness
    """Stiffness of the clamp at the sleeve's sealed ends and seam [pressure / length]; a dome's tip is not sealed."""
    clamp_length: Length
    """Distance over which the clamp's stiffness decays [length]."""


class FoamPad(Frozen):
    """A compressible foam under a thin cover, on a rigid base."""

    medium: Literal["foam pad"] = "foam pad"
    sheet: SkinSheet
    young: Pressure
    """Oedometric modulus of the foam [pressure]."""
    shear: Pressure
    """Shear modulus of the foam [pressure]."""
    thickness: Length
    """Thickness of the foam at rest, between cover and base [length]."""
    densification: Share
    """Compressive strain at which the foam becomes solid [1]."""
    cover_tension: Tension
    """Membrane tension of the foam's cover [force / length]."""
    cover_bending: BendingStiffness
    """Bending stiffness of the foam's cover [force x length]."""
    contact_stiffness: Stiffness
    """Penalty stiffness against an indenter's penetration [pressure / length]; not a property of the material."""


class BondedLayer(Frozen):
    """A linear elastic layer that is bonded to a rigid base and frictionless on its outer surface."""

    medium: Literal["bonded layer"] = "bonded layer"
    sheet: SkinSheet
    young: Pressure
    """Young's modulus of the elastic layer [pressure]."""
    poisson: Share
    """Poisson's ratio of the elastic layer, 0 to below 0.5 [1]."""
    thickness: Length
    """Thickness of the unloaded layer, between surface and base [length]."""
    contact_stiffness: Stiffness
    """Penalty stiffness against an indenter's penetration [pressure / length], no property of the material: `ideal` has
    60 times its young / thickness. If it is low, the indenter penetrates and hardly deforms the layer."""


Skin = Annotated[FluidBackedShell | FoamPad | BondedLayer, Field(discriminator="medium")]
"""Any skin that the simulation ``twin`` can press."""
