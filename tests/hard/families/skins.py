"""Hard skins: moduli over four decades, rubber that keeps its volume, foam gone solid, a film that closes."""

import math

import numpy as np

from tactbench.plugin.simulation import FluidBackedShell
from tactbench.rigs.twin.contact.media import CUT_OVER, Foam
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import skin_grid
from tests.hard.families.contact import SOLVED, draw_contact, draw_skin, lawful, press_of, skins

_STIFFNESSES = (
    "young", "shear", "tension", "cover_tension", "cover_bending", "contact_stiffness", "core_stiffness",
    "clamp_stiffness",
)  # fmt: skip
"""Everything in a skin that is measured in newtons."""
_ABOVE_ZERO = ("young", "thickness", "mid_radius", "contact_stiffness", "densification")


def _changed(skin, **values):
    return skin.model_copy(
        update={name: getattr(skin, name).model_copy(update={"value": value}) for name, value in values.items()}
    )


def _times(skin, factor, *names):
    return _changed(skin, **{name: factor * getattr(skin, name).value for name in names})


def _own(skin, names=_STIFFNESSES):
    return [name for name in names if hasattr(skin, name)]


def scaled_moduli(case):
    """Give the same depth when all stiffnesses and the load are multiplied alike, over four decades."""
    skin = draw_skin(case)
    factor, load = case.decades(1e-2, 1e2), case.decades(1e-3, 5.0)
    case.says(factor=factor)
    contact = draw_contact(case, skin, case.decades(5.0, 100.0))
    plain = lawful(case, press_of(skin, contact), [load])[0].depth_mm
    found = lawful(case, press_of(_times(skin, factor, *_own(skin)), contact), [factor * load])[0].depth_mm
    case.holds(abs(found / plain - 1) <= 2 * SOLVED, f"depth {found!r} mm, unscaled {plain!r} mm")


def one_modulus(case):
    """Solve a skin one of whose stiffnesses is multiplied over four decades."""
    skin = draw_skin(case)
    name = case.one_of(*_own(skin))
    factor = case.decades(1e-2, 1e2)
    case.says(stiffness=name, factor=factor)
    contact = draw_contact(case, skin, case.decades(5.0, 100.0))
    loads = sorted(case.decades(1e-3, 5.0) for _ in range(2))
    lawful(case, press_of(_times(skin, factor, name), contact), loads)


def any_poisson_ratio(case):
    """Solve rubber up to Poisson's ratio 1/2 exactly; refuse ratios above it and below 0.

    Within 1e-9 of 1/2 the layer is as deep as at 1/2, to 1 in 1000: the lubrication limit is met, not jumped to.
    """
    skin = skins()[case.one_of("ideal", "biotac")]
    below = case.decades(1e-12, 0.5)
    ratio = (0.5 - below, 0.5, 0.5 + below, -below)[case.rng.choice(4, p=[0.6, 0.2, 0.1, 0.1])]
    case.says(medium=skin.medium, poisson=ratio)
    case.right = "answer" if 0 <= ratio <= 0.5 else "refusal"
    if skin.medium == "bonded layer":
        skin = _changed(skin, thickness=case.decades(0.1, 5.0))
    contact = draw_contact(case, skin, case.decades(5.0, 100.0), margin=0.4)
    load = case.decades(1e-3, 5.0)
    state = lawful(case, press_of(_changed(skin, poisson=ratio), contact), [load])[0]
    if 0.5 - ratio < 1e-9:
        limit = press_of(_changed(skin, poisson=0.5), contact)(load).depth_mm
        case.holds(abs(state.depth_mm / limit - 1) <= 1e-3, f"depth {state.depth_mm!r} mm, at 1/2 {limit!r} mm")


def foam_gone_solid(case):
    """Stay finite, balanced and monotone far beyond densification; keep the law convex, and its energy's slope."""
    skin = skins()["icub"]
    limit, thickness = case.decades(0.05, 1.0), case.decades(0.5, 5.0)
    case.says(densification=limit, thickness_mm=thickness)
    changed = _changed(skin, densification=limit, thickness=thickness)
    press = press_of(changed, draw_contact(case, skin, case.decades(8.0, 1e3)))
    lawful(case, press, sorted(case.decades(1e-3, 500.0) for _ in range(3)))
    law = Foam(1.0, limit, np.ones((1, 400)))
    share = np.sort(case.rng.uniform(-3.0, 3.0, 400))
    share[:3] = (-CUT_OVER, 0.0, CUT_OVER)
    u = np.sort(share)[None, :] * limit
    tangent = np.empty_like(u)
    pressure, _ = law(u, tangent)
    case.holds(np.isfinite(pressure).all() and np.all(np.diff(pressure) >= 0) and np.all(tangent > 0), "no convex law")
    step = 1e-6 * limit
    # Central difference of one cell's energy: second order in the step; its rounding, 1e-16 of the energy, over it.
    one = Foam(1.0, limit, np.ones((1, 1)))
    at = float(u[0, case.rng.integers(u.size)])
    (up, _), (down, _), (energy, slope) = (
        (found[1], float(found[0][0, 0]))
        for found in (one(np.array([[place]]), np.empty((1, 1))) for place in (at + step, at - step, at))
    )
    near = 1e-4 * abs(slope) + 1e-15 * energy / step + 1e-9
    found = (up - down) / (2 * step)
    case.holds(abs(found - slope) <= near, f"energy's slope {found!r}, not {slope!r}")


def film_that_closes(case):
    """Never thin the film below what asperities keep open, nor jump in depth, around touch-down.

    Below the load that closes it, the core changes nothing.
    """
    skin = skins()["biotac"]
    assert isinstance(skin, FluidBackedShell)
    contact = draw_contact(case, skin, case.decades(4.0, 40.0), margin=0.4)
    gap = press_of(skin, contact).gap_mm
    bare = Press(medium_of(skin, skin_grid(skin.sheet)), gap, contact)
    low, high = 0.0, 6.0
    if bare.closing_at(high) > 0:
        while high - low > 1e-3:
            middle = (low + high) / 2
            low, high = (low, middle) if bare.closing_at(middle) > 0 else (middle, high)
    loads = [max(low, 1e-2), high, high * 1.01]
    states = lawful(case, press_of(skin, contact), loads)
    for state in states:
        case.holds(state.thickness_mm.min() >= skin.residual_film.to("mm"), f"no film is left at {state.force_n:g} N")
    jump = states[1].depth_mm - states[0].depth_mm
    # Depth grows no faster than in proportion to the load (it is concave in it, from zero); 1e-6 N of slack.
    most = states[0].depth_mm * ((loads[1] + 1e-6) / loads[0] - 1) + SOLVED
    case.holds(jump <= most, f"depth jumps by {jump:g} mm from {loads[0]:g} to {loads[1]:g} N")
    if bare.closing_at(loads[0]) <= 0:
        without = bare(loads[0]).depth_mm
        case.holds(
            abs(states[0].depth_mm / without - 1) <= SOLVED, f"{states[0].depth_mm!r} mm, coreless {without!r} mm"
        )


def impossible_skins(case):
    """Refuse no number, infinity and less than zero in any number of a skin, and zero where it must be above zero."""
    skin, above = draw_skin(case), case.chance(0.5)
    names = _ABOVE_ZERO if above else ("poisson", *_STIFFNESSES, "residual_film", "clamp_length")
    name = case.one_of(*_own(skin, names))
    value = (math.nan, math.inf, -case.decades(1e-6, 1e6), 0.0)[case.rng.integers(4 if above else 3)]
    case.says(parameter=name, value=value)
    case.right = "refusal"
    press_of(_changed(skin, **{name: value}), draw_contact(case, skin, 5.0, margin=0.45))(5.0)


def impossible_sheets(case):
    """Refuse a sheet without area, without a radius or with hardly a cell."""
    skin = draw_skin(case)
    contact = draw_contact(case, skin, 10.0)
    name = case.one_of("x_max", "arc", "outer_radius", "cells")
    wrong: object
    if name == "cells":
        wrong = (int(case.rng.integers(-3, 4)), int(case.rng.integers(0, 100)))
    else:
        value = (-math.inf, 0.0 if name != "x_max" else -1e3, math.nan, -case.decades(1e2, 1e6))[case.rng.integers(4)]
        wrong = skin.sheet.x_max.model_copy(update={"value": value})
    case.says(sheet=name, value=str(wrong))
    case.right = "refusal"
    press_of(skin.model_copy(update={"sheet": skin.sheet.model_copy(update={name: wrong})}), contact)(1.0)


FAMILIES = (
    scaled_moduli, one_modulus, any_poisson_ratio, foam_gone_solid, film_that_closes, impossible_skins,
    impossible_sheets,
)  # fmt: skip
