"""What is pressed: how a scene says it, and that caps and flat surfaces are stored as they were before shapes."""

from __future__ import annotations

import json

import pytest
from pydantic import ValidationError

from tactbench.core.errors import UsageError
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import Indenter, Scene


def _q(value, unit="mm"):
    return assumed(value, unit, "a test")


def test_a_cap_and_a_flat_surface_are_stored_as_before_shapes():
    assert Indenter().model_dump() == {"radius": None}
    assert json.loads(Indenter(radius=_q(5)).model_dump_json()) == {
        "radius": {"value": 5.0, "unit": "mm", "source": {"tag": "assumed", "reference": "a test"}}
    }
    assert str(Indenter(radius=_q(5))) == "cap R 5 mm"
    assert str(Indenter()) == "flat"


def test_another_shape_survives_json():
    edge = Indenter(shape="edge", dimensions={"tip_radius": _q(0.4)}, angle=_q(30, "deg"))
    scene = Scene(name="a", indenter=edge)
    assert Scene.model_validate_json(scene.model_dump_json()) == scene
    assert Scene.model_validate(scene.model_dump()) == scene
    assert str(edge) == "edge tip_radius 0.4 mm, turned by 30 deg"


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"shape": "cap"}, "dimensions: a cap is given by its radius"),
        ({"shape": "pin", "radius": _q(2)}, "radius: it is that of a cap; give the dimensions of 'pin'"),
        ({"dimensions": {"width": _q(2)}}, "dimensions: a flat surface has none of width"),
        ({"shape": "cap", "dimensions": {"radius": _q(2), "width": _q(2)}}, "dimensions: a cap has none of width"),
        ({"radius": _q(2), "angle": _q(30, "deg")}, "angle: 30 deg is given; a cap and a flat surface"),
    ],
)
def test_what_is_no_body_is_refused_by_field(given, says):
    with pytest.raises(ValidationError, match=says):
        Indenter(**given)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"length": _q(2)}, "The indenter 'cylinder': 'length' is given, and it has no such number"),
        ({"radius": _q(2, "s")}, "The indenter 'cylinder': radius is given as 2 s, and a number in mm is expected"),
        ({"radius": _q(-2)}, "The indenter 'cylinder': radius is given as -2 mm, and 0.01 mm or more is expected"),
        ({"radius": _q(float("nan"))}, "radius is given as nan mm"),
    ],
)
def test_a_dimension_that_cannot_be_is_named_with_what_is_expected(given, says):
    with pytest.raises(UsageError, match=says):
        installed().indenters["cylinder"].sizes(given)


def test_dimensions_come_in_the_unit_of_the_shape_and_others_by_default():
    assert installed().indenters["pin"].sizes({"radius": _q(0.003, "m")}) == {"radius": 3.0, "fillet": 0.0}
