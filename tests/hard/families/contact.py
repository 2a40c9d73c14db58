"""Hard contacts: radii, loads, edges and tilts at the ends of their ranges, on every installed skin."""

import math
from collections.abc import Callable

import numpy as np

from tactbench.plugin import load_registry
from tactbench.plugin.simulation import FluidBackedShell, SkinState
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.press import Press, check_reach, remarks
from tactbench.rigs.twin.contact.shell import with_core
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, check_contact, gap_mm, skin_grid

BALANCE = 1e-8
"""Relative force balance: a sum over thousands of cells rounds at 1e-13, and the law shall hold far from its edge."""
SOLVED = 1e-5
"""Relative error of a depth: ten times the solver's residual."""


def skins():
    """Return the skin of every installed sensor that declares one."""
    found = {sensor.spec.name: sensor.spec.skin for sensor in load_registry().sensors}
    return {name: skin for name, skin in found.items() if skin is not None}


def draw_skin(case):
    """Draw an installed skin."""
    known = skins()
    name = case.one_of(*sorted(known))
    case.says(skin=name)
    return known[name]


def press_of(skin, contact, cells=None):
    """Return `skin` under an indenter, its core included; raises RigError where the contact cannot be."""
    grid = skin_grid(skin.sheet, cells)
    check_contact(grid, contact)
    core: Callable[[Medium], Medium] | None = None
    if isinstance(skin, FluidBackedShell):

        def core(medium):
            return with_core(medium, skin)

    sheet = skin.sheet
    gap = gap_mm(grid, contact, sheet)
    return Press(medium_of(skin, grid), gap, contact, core=core)


def draw_contact(case, skin, radius, *, margin=0.25, tilt=0.0):
    """Draw an apex; `margin` is the share of the sheet on each side that is left alone (negative: outside)."""
    sheet = skin.sheet
    low, high, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    x = low + (high - low) * case.uniform(margin, 1 - margin)
    s = arc * (case.uniform(margin, 1 - margin) - 0.5)
    slopes = (math.tan(case.uniform(-tilt, tilt)), math.tan(case.uniform(-tilt, tilt)))
    case.says(radius_mm=radius, x_mm=x, s_mm=s, slope_x=slopes[0], slope_s=slopes[1])
    return Contact(radius, x, s, *slopes)


def lawful(case, press, loads):
    """Solve ascending loads; hold each against its laws and each pair against monotony."""
    case.says(loads_n=", ".join(f"{load:.4g}" for load in loads))
    dx, ds = press.medium.grid.cell_mm
    states: list[SkinState] = []
    for load in loads:
        state = press(load)
        for what in (
            "deflection_mm", "pressure_mpa", "thickness_mm", "depth_mm", "fluid_pressure_mpa", "contact_radius_mm"
        ):  # fmt: skip
            case.holds(np.isfinite(getattr(state, what)).all(), f"{what} at {load:g} N is not finite")
        case.holds(np.all(state.pressure_mpa >= 0), f"the indenter pulls at {load:g} N")
        carried = float(state.pressure_mpa.sum()) * dx * ds
        case.holds(abs(carried - load) <= BALANCE * load, f"{carried!r} N are carried of {load!r} N")
        if press.medium.zero_mean:
            # Rounding of a sum over thousands of cells, of a field whose largest value is the scale.
            scale = float(np.abs(state.deflection_mm).max())
            case.holds(abs(state.deflection_mm.mean()) <= 1e-12 * scale, f"the fluid loses volume at {load:g} N")
        if states and load > states[-1].force_n:
            before = states[-1].depth_mm
            case.holds(state.depth_mm >= before * (1 - SOLVED), f"depth falls to {state.depth_mm!r} at {load:g} N")
        states.append(state)
    return states


def reaches(press, skin, load):
    """Raise RigError where the indenter ends before the skin that it touches."""
    check_reach(press, load, skin.sheet)


def _loads(case, low, high):
    return sorted(case.decades(low, high) for _ in range(3))


def any_radius(case):
    """Solve caps of 1e-4 mm to infinity; refuse them below a cell and past their rim.

    A cap of 3 mm or more under up to 5 N has an answer on every skin of ours.
    """
    skin = draw_skin(case)
    radius = math.inf if case.chance(0.1) else case.decades(1e-4, 1e9)
    loads = _loads(case, 1e-12, 5.0)
    cell = max(skin_grid(skin.sheet).cell_mm)
    case.right = "refusal" if radius < cell else "either" if radius < 3.0 else "answer"
    press = press_of(skin, draw_contact(case, skin, radius))
    states = lawful(case, press, loads)
    reaches(press, skin, loads[-1])
    told = remarks(press, loads[-1], skin.sheet)
    few = np.count_nonzero(states[-1].pressure_mpa) < math.pi * 3**2
    case.holds(
        ("remark contact" in told) == few, "a contact below three cells in radius must be remarked on, and only it"
    )


def past_the_rim(case):
    """Refuse a load under which the skin is touched where the cap has ended, and no other."""
    skin = draw_skin(case)
    press = press_of(skin, draw_contact(case, skin, case.uniform(0.5, 2.0)))
    state = lawful(case, press, [case.decades(1.0, 500.0)])[0]
    touched = press.gap_mm[state.pressure_mpa > 0]
    # Every gap under a cap is below its radius and the finger's fall; beyond it there are 50 mm more.
    case.right = "refusal" if touched.max() > 30.0 else "answer"
    reaches(press, skin, state.force_n)


def a_cap_that_is_none(case):
    """Refuse radii of zero, below zero and not a number."""
    skin = draw_skin(case)
    radius = (0.0, -case.decades(1e-3, 1e3), math.nan)[case.rng.integers(3)]
    case.right = "refusal"
    press_of(skin, draw_contact(case, skin, radius))


def unresolved_contact(case):
    """Agree with the same contact on cells half as wide to 5 %, or remark on it.

    Measured on the ideal grid: up to 2 % at three cells, and rising quickly below.
    """
    skin = skins()["ideal"]
    contact = draw_contact(case, skin, case.decades(1.0, 30.0), margin=0.4)
    load = case.decades(1e-3, 3.0)
    coarse, fine = press_of(skin, contact), press_of(skin, contact, (96, 96))
    depth = lawful(case, coarse, [load])[0].depth_mm
    if "remark contact" in remarks(coarse, load, skin.sheet):
        return
    wanted = fine(load).depth_mm
    case.holds(abs(depth / wanted - 1) <= 0.05, f"depth {depth:g} mm against {wanted:g} mm, and no remark")


def flat_is_a_huge_cap(case):
    """Take R of 1e9 mm or more for a flat surface.

    The depth moves by no more than the gap does: the energy's minimiser is monotone in the gap and moves with it as a
    whole, so that depth is a contraction of the gap in the maximum norm. The least gap counts twice.
    """
    skin = draw_skin(case)
    flat = draw_contact(case, skin, math.inf)
    huge = Contact(case.decades(1e9, 1e15), flat.x_mm, flat.s_mm)
    load = case.decades(1e-6, 100.0)
    first, second = (lawful(case, press_of(skin, one), [load])[0].depth_mm for one in (flat, huge))
    grid, sheet = skin_grid(skin.sheet), skin.sheet
    apart = float(np.abs(gap_mm(grid, flat, sheet) - gap_mm(grid, huge, sheet)).max())
    r2 = grid.x_mm.size**2 * grid.cell_mm[0] ** 2 + grid.s_mm.size**2 * grid.cell_mm[1] ** 2
    case.holds(apart <= r2 / (2 * huge.radius_mm) * 1.01 + 1e-13, f"the cap sags by {apart!r} mm")
    case.holds(abs(first - second) <= 2 * apart + SOLVED * first, f"{first!r} mm flat, {second!r} mm huge")


def any_load(case):
    """Be at rest exactly at 0 N; finite, balanced and monotone from 1e-12 to 500 N, with a remark beyond 5 N."""
    skin = draw_skin(case)
    press = press_of(skin, draw_contact(case, skin, case.decades(5.0, 1e3)))
    rest = press(0.0)
    case.holds(rest.depth_mm == 0 and not rest.deflection_mm.any() and not rest.pressure_mpa.any(), "no rest at 0 N")
    loads = [1e-12, *_loads(case, 1e-12, 500.0), 500.0]
    states = lawful(case, press, loads)
    case.holds(0 < states[0].depth_mm < 1e-9, f"a piconewton presses {states[0].depth_mm:g} mm deep")
    case.right = "either"
    reaches(press, skin, loads[-1])
    case.holds("remark load" in remarks(press, loads[-1], skin.sheet), "500 N and no remark")


def loads_that_are_none(case):
    """Be at rest below 0 N; refuse a load that is infinite or no number."""
    skin = draw_skin(case)
    press = press_of(skin, draw_contact(case, skin, 10.0))
    case.holds(press(-case.decades(1e-9, 1e3)).depth_mm == 0.0, "a pull presses")
    case.right = "refusal"
    press(math.nan if case.chance(0.5) else math.inf)


def edge_and_tilt(case):
    """Solve grazing, edge and tilted contacts; refuse them outside the skin and beyond 45 degrees.

    All skins are mirror images of themselves across s = 0, so that a mirrored contact is as deep.
    """
    skin = draw_skin(case)
    tilt = case.uniform(0.0, 1.4)
    contact = draw_contact(case, skin, case.decades(3.0, 1e3), margin=-0.05, tilt=tilt)
    sheet = skin.sheet
    inside = (
        sheet.x_min.to("mm") <= contact.x_mm <= sheet.x_max.to("mm") and abs(contact.s_mm) <= sheet.arc.to("mm") / 2
    )
    gentle = math.hypot(contact.tilt_x, contact.tilt_s) <= 1
    case.right = "answer" if inside and gentle else "refusal"
    press = press_of(skin, contact)
    state = lawful(case, press, _loads(case, 1e-6, 5.0))[-1]
    mirrored = Contact(contact.radius_mm, contact.x_mm, -contact.s_mm, contact.tilt_x, -contact.tilt_s)
    twin = press_of(skin, mirrored)(state.force_n)
    # Rounding decides which of two mirrored cells is met first; the depth feels it as far as the residual lets it.
    case.holds(
        abs(twin.depth_mm / state.depth_mm - 1) <= 2 * SOLVED, f"mirrored {twin.depth_mm!r}, not {state.depth_mm!r}"
    )
    case.holds(not press.gap_mm.min(), "the approach has lost its origin")


FAMILIES = (
    any_radius, past_the_rim, a_cap_that_is_none, unresolved_contact, flat_is_a_huge_cap, any_load, loads_that_are_none,
    edge_and_tilt,
)  # fmt: skip
