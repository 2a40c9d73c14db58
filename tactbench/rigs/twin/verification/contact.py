"""The checks of contact: the reference solver against theory, the default one against the reference."""

from __future__ import annotations

from collections.abc import Sequence

from tactbench.plugin.simulation import Check
from tactbench.rigs.twin.verification import friction_and_adhesion, half_space, kernels, layers

GROUP = "contact"


def checks() -> Sequence[Check]:
    """Return the checks of this group, none of them carried out yet; all take some seconds together."""
    return [
        Check("hertz", GROUP, "Reference solver against Hertz: depth, pressure, radius, order", half_space.hertz),
        Check("flat-punch", GROUP, "Reference solver against flat punches", half_space.flat_punch),
        Check("point-load", GROUP, "Half-space kernel against a point load", half_space.point_load),
        Check("kernel-laws", GROUP, "Superposition, reciprocity, symmetry of the kernels", kernels.laws),
        Check("scaling", GROUP, "Depth when modulus, force and lengths scale", kernels.scaling),
        Check("thin-layers", GROUP, "Layer kernel against the limits of thin layers", layers.thin),
        Check("layer-elements", GROUP, "Both solvers on layers against finite elements", layers.elements),
        Check("penalty", GROUP, "Default solver against the reference: the cost of its penalty", layers.penalty),
        Check("jkr", GROUP, "Adhesive contact: energy, limits, superposition", friction_and_adhesion.jkr),
        Check(
            "partial-slip", GROUP, "Partial slip as the difference of two contacts", friction_and_adhesion.partial_slip
        ),
    ]  # fmt: skip
