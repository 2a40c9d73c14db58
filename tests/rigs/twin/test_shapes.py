"""Indenters that are neither flat nor caps: their heights, and what the solvers make of them against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.plugin import (
    FloatArray,
    ForceRamp,
    Indenter,
    RigError,
    Scene,
    UsageError,
)
from tactbench.plugin.simulation import BondedLayer, FoamPad, SkinSheet, Slide
from tactbench.rigs.twin.contact.press import Press, remarks
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, Shape, check_contact, gap_mm, shape_of, skin_grid
from tactbench.sensors.ideal import tactbench_sensors
from tests.rigs.twin.conftest import TWIN, q

INDENTERS = TWIN.indenters


def shape(name: str, angle: float = 0.0, **sizes: float) -> Shape:
    units = {name: one.unit for name, one in next(one for one in INDENTERS if one.name == name).dimensions.items()}
    stated = {size: q(value, units[size]) for size, value in sizes.items()}
    found = shape_of(Indenter(shape=name, dimensions=stated, angle=q(angle, "deg")), INDENTERS)
    assert found is not None
    return found


def pressed_by(body: Shape) -> Contact:
    return Contact(math.inf, 0.0, 0.0, shape=body)


def sheet(cells: int) -> SkinSheet:
    return SkinSheet(x_min=q(-8), x_max=q(8), arc=q(16), cells=(cells, cells))


# Nothing but columns: no shear, no cover, and so little strain that the foam is linear.
FOAM = {
    "young": q(0.2, "MPa"), "thickness": q(2.0), "densification": q(1e9, "1"), "shear": q(0.0, "MPa"),
    "cover_tension": q(0.0, "N/mm"), "cover_bending": q(0.0, "N*mm"), "contact_stiffness": q(1e3, "MPa/mm"),
}  # fmt: skip
K = 0.1
"""Of the columns: young / thickness [MPa/mm]."""


def columns(body: Shape, force_n: float, cells: int = 64):
    skin = FoamPad(sheet=sheet(cells), **FOAM)
    grid = skin_grid(skin.sheet)
    return Press(medium_of(skin, grid), gap_mm(grid, pressed_by(body)), pressed_by(body))(force_n)


# Force of a depth d on columns k under a line of length L = 16: k L ∫ (d - h(y))+ dy.
def line_on_columns(depth: float, height) -> float:
    y = np.linspace(-8, 8, 200_001)
    return float(K * 16 * np.trapezoid(np.maximum(depth - height(y), 0.0), y))


@pytest.mark.parametrize(
    ("body", "height"),
    [
        (shape("cylinder", radius=6.0), lambda y: 6.0 - np.sqrt(np.maximum(36.0 - y**2, 0.0))),
        (shape("edge", wedge_angle=140.0, tip_radius=0.0), lambda y: np.abs(y) / math.tan(math.radians(70.0))),
    ],
    ids=["cylinder", "sharp edge"],
)
@pytest.mark.parametrize("angle", [0.0, 90.0])
def test_a_line_on_columns_is_as_deep_as_the_closed_form(body, height, angle):
    turned = Shape(body.name, body.sizes, math.radians(angle), body.height)
    force = line_on_columns(1.0, height)
    # Depths count from the lowest cell centre, half a cell beside the line. The penalty yields by 1e-4 of the depth;
    # sums over cells of a quarter of a millimetre are off by the square of their share of the width, some thousandths.
    lowest = float(turned.height_mm(np.array([0.125]), np.array([0.125]))[0])
    assert columns(turned, force).depth_mm + lowest == pytest.approx(1.0, rel=0.003)


def test_a_pin_on_columns_presses_what_stands_under_it():
    state = columns(shape("pin", radius=2.5), 1.0)
    touched = state.pressure_mpa > 0
    area = np.count_nonzero(touched) * 0.25**2
    # A circle of whole cells, ten in radius: their number is that of its area to one in a hundred.
    assert area == pytest.approx(math.pi * 2.5**2, rel=0.02)
    np.testing.assert_allclose(state.pressure_mpa[touched], 1.0 / area, rtol=1e-3)
    assert state.depth_mm == pytest.approx(1.0 / area / K, rel=2e-3)  # and a hundredth of it in the penalty's springs


LAYER = BondedLayer(
    sheet=sheet(48), young=q(1.0, "MPa"), poisson=q(0.3, "1"), thickness=q(2.0), contact_stiffness=q(300, "MPa/mm")
)
MEDIUM = medium_of(LAYER, skin_grid(LAYER.sheet))


def layered(body: Shape) -> Press:
    """Return the press of a bonded layer of 2 mm."""
    return Press(MEDIUM, gap_mm(MEDIUM.grid, pressed_by(body)), pressed_by(body))


def test_contacts_of_other_dimensions_and_angles_are_solved_anew():
    (ideal,) = tactbench_sensors()
    found = []
    for size, angle in ((4.0, 0.0), (4.0, 90.0), (8.0, 0.0)):
        edge = Indenter(shape="cylinder", dimensions={"radius": q(size)}, angle=q(angle, "deg"))
        slide = Slide(speed=q(1, "mm/s"), start=q(30, "s"))
        scene = Scene(name="a", indenter=edge, slide=slide, profile=ForceRamp(samples=20))
        with TWIN.open(ideal, scene, seed=1) as recording:
            found.append(np.concatenate([one.data for one in recording if one.stream == "taxels"]))
            assert recording.assumptions["indenter radius"] == size
    assert not np.array_equal(found[0], found[1])
    assert not np.array_equal(found[0], found[2])


def height_at(body: Shape, x: float, y: float) -> float:
    found: FloatArray = body.height_mm(np.array([x]), np.array([y]))
    return float(found[0])


def test_the_angle_turns_from_x_towards_s():
    body = shape("cylinder", radius=5.0, angle=30.0)
    along = np.array([math.cos(math.radians(30)), math.sin(math.radians(30))])
    assert height_at(body, *(3 * along)) == pytest.approx(0.0, abs=1e-12)  # the cylinder's own axis
    assert height_at(body, *(3 * along[::-1] * [-1, 1])) == pytest.approx(1.0)  # 5 - sqrt(25 - 9)


def test_a_rounded_edge_leaves_its_tip_without_a_kink():
    body = shape("edge", wedge_angle=120.0, tip_radius=2.0)
    y = np.linspace(0.0, 4.0, 4001)
    slope = np.diff(body.height_mm(np.zeros(1), y)) / np.diff(y)
    assert slope[-1] == pytest.approx(1 / math.tan(math.radians(60)))
    # 1e-3 mm over a radius of 2 mm is half a thousandth, steepest at the end.
    assert np.abs(np.diff(slope)).max() < 1e-3


def test_a_pin_that_is_all_fillet_is_a_cap():
    pin, x = shape("pin", radius=3.0, fillet=3.0), np.linspace(-2.9, 2.9, 59)
    np.testing.assert_allclose(pin.height_mm(x, 0 * x), 3 - np.sqrt(9 - x**2), rtol=1e-12, atol=1e-15)
    assert height_at(pin, 3.1, 0.0) > 50
    with pytest.raises(UsageError, match="fillet"):
        height_at(shape("pin", radius=3.0, fillet=4.0), 0.0, 0.0)


@pytest.mark.parametrize("body", [shape("pin", radius=0.2), shape("edge", wedge_angle=80.0, tip_radius=0.0)])
def test_a_shape_that_the_grid_cannot_resolve_is_refused(body):
    with pytest.raises(RigError, match=body.name):
        check_contact(skin_grid(sheet(64)), pressed_by(body))


@pytest.mark.parametrize(
    ("sizes", "load", "expected"),
    [
        ({"wedge_angle": 100.0, "tip_radius": 0.0}, 0.5, "remark contact"),
        ({"wedge_angle": 60.0, "tip_radius": 0.5}, 20.0, "remark flank"),
    ],
)
def test_a_narrow_line_however_long_and_a_flank_steeper_than_45_degrees_are_remarked_upon(sizes, load, expected):
    assert expected in remarks(layered(shape("edge", **sizes)), load, LAYER.sheet)


def test_a_shape_that_is_not_installed_or_of_another_unit_is_refused_with_what_there_is(sensors):
    with pytest.raises(RigError, match="'knob'") as caught:
        TWIN.plan(sensors["icub"], Scene(name="a", indenter=Indenter(shape="knob")))
    assert all(one in caught.value.hint for one in ("cap", "cylinder", "edge", "flat", "pin"))
    edge = Indenter(shape="edge", dimensions={"tip_radius": q(2, "N")})
    with pytest.raises(UsageError, match=r"'edge': tip_radius: .*'N'.*'mm'"):
        TWIN.plan(sensors["icub"], Scene(name="a", indenter=edge))
