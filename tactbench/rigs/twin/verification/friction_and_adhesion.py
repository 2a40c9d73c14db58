"""Checks of closed forms for sticking and slipping contacts, with the reference solver where it has a say."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin.simulation import Verdict
from tactbench.rigs.twin.boundary_elements.kernels import HalfSpace
from tactbench.rigs.twin.closed_forms.adhesion import Jkr
from tactbench.rigs.twin.closed_forms.half_space import Hertz
from tactbench.rigs.twin.closed_forms.tangential import CattaneoMindlin
from tactbench.rigs.twin.verification.pressing import (
    RADIUS_MM,
    centres_mm,
    paraboloid_mm,
    pressed,
    rms,
    within,
)

_SIDE_MM = 8.0


def jkr() -> Sequence[Verdict]:
    """Hold the adhesive contact against its parts: Hertz, less a flat punch, with the energy at its least."""
    law, hertz = Jkr(RADIUS_MM, 1.0, 2e-3), Hertz(RADIUS_MM, 1.0)
    source = "Johnson 1985, section 5.5"
    radii = np.linspace(0.3, 3.0, 20001) * law.pull_off_radius_mm
    least = min(law.force_n(float(a)) for a in radii)
    a, step = 1.5, 1e-4
    # Along the curve of equilibria the work of the force goes into elasticity, less what adhesion gives: w dA.
    elastic = [_elastic_energy(law, a + sign * step) for sign in (1, -1)]
    work = law.force_n(a) * (law.depth_mm(a + step) - law.depth_mm(a - step))
    released = elastic[0] - elastic[1] - work
    adhesive = law.work_n_per_mm * math.pi * ((a + step) ** 2 - (a - step) ** 2)
    x = centres_mm(128, _SIDE_MM)
    r = np.hypot(x[:, None], x[None, :])
    punch = pressed(HalfSpace(1.0), np.where(r <= a, 0.0, math.inf), _SIDE_MM, 1.0)
    ball = pressed(HalfSpace(1.0), paraboloid_mm(128, _SIDE_MM), _SIDE_MM, hertz.force_n(a**2 / RADIUS_MM))
    pull = (ball.depth_mm - law.depth_mm(a)) / punch.depth_mm
    return [
        within("pull-off is the least force", least / law.pull_off_n - 1, 1e-8, source=source),
        within(
            "radius of a force of a radius",
            law.contact_radius_mm(law.force_n(a)) / a - 1,
            1e-12,
            source=f"{source}; bound: rounding",
        ),
        within(
            "no adhesion is Hertz",
            Jkr(RADIUS_MM, 1.0, 0.0).contact_radius_mm(1.0) / hertz.contact_radius_mm(1.0) - 1,
            1e-12,
            source=f"{source}; bound: rounding",
        ),
        within(
            "energy released over work of adhesion",
            -released / adhesive - 1 if released < 0 else released / adhesive - 1,
            1e-6,
            source="Griffith; bound: second order of the step in radius",
        ),
        within(
            "force: boundary elements' ball less their punch",
            (ball.force_n - pull - law.force_n(a)) / ball.force_n,
            0.1 * _SIDE_MM / 128 / a,
            source=f"{source}: Hertz less a punch; over Hertz's force; bound: a tenth of a cell over the radius",
        ),
    ]


def _elastic_energy(law: Jkr, a: float) -> float:
    """Return the elastic energy of a ball pressed to a radius, then lifted by a punch of that radius."""
    e, r = law.modulus_mpa, law.radius_mm
    lift = a**2 / r - law.depth_mm(a)
    hertz = Hertz(r, e).force_n(a**2 / r)
    # Hertz: 2/5 F d. Lifting by l at a constant radius takes F l - a E* l² out.
    return 0.4 * hertz * a**2 / r - hertz * lift + a * e * lift**2


def partial_slip() -> Sequence[Verdict]:
    """Hold partial slip against two normal contacts, of the load and of the load that would just slip less.

    With equal normal and tangential influence the traction is friction times the difference of two pressures under
    the same indenter (Jäger 1998; Ciavarella 1998), whose smaller contact sticks.
    """
    friction, normal = 0.6, 1.0
    cells = 128
    gap = paraboloid_mm(cells, _SIDE_MM)
    whole = pressed(HalfSpace(1.0), gap, _SIDE_MM, normal)
    hertz = Hertz(RADIUS_MM, 1.0)
    law = CattaneoMindlin(friction, hertz.contact_radius_mm(normal), normal, tangential_modulus_mpa=1.0)
    x = centres_mm(cells, _SIDE_MM)
    r = np.hypot(x[:, None], x[None, :])
    verdicts = []
    for share in (0.3, 0.6, 0.9):
        push = share * friction * normal
        stuck = pressed(HalfSpace(1.0), gap, _SIDE_MM, normal - push / friction)
        traction = friction * (whole.pressure_mpa - stuck.pressure_mpa)
        truth = law.traction_mpa(push, r)
        away = np.abs(r - law.stick_radius_mm(push)) > 2 * _SIDE_MM / cells
        away &= np.abs(r - law.contact_radius_mm) > 2 * _SIDE_MM / cells
        shift = friction * (whole.depth_mm - stuck.depth_mm)
        verdicts += [
            within(
                f"stick radius at {share:.0%} of slip",
                stuck.contact_radius_mm / whole.contact_radius_mm - law.stick_radius_mm(push) / law.contact_radius_mm,
                1e-3,
                source="Johnson 1985, section 7.2; bound: the smaller contact's radius at 14 cells",
            ),
            within(
                f"traction at {share:.0%} of slip, rms over its largest",
                rms(list((traction - truth)[away])) / float(truth.max()),
                3e-3,
                source="Johnson 1985, section 7.2; bound: (h/a)² at 14 cells, two cells off the rims",
            ),
            within(
                f"shift at {share:.0%} of slip",
                shift / law.shift_mm(push) - 1,
                1e-3,
                source="Johnson 1985, section 7.2; bound: the depth's error at 14 cells",
            ),
        ]
    slope = law.shift_mm(1e-6) / 1e-6 / law.compliance_mm_per_n
    verdicts.append(within("compliance without slip", slope - 1, 1e-5, source="Mindlin 1949; bound: the push itself"))
    return verdicts
