"""What is refused and what is remarked on when a contact leaves the model's ground."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.plugin import RigError
from tactbench.rigs.twin.contact.press import remarks
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, skin_grid
from tests.hard.families.contact import press_of
from tests.rigs.twin.conftest import SPECS


def pressed(name, radius, x=0.0):
    """Return a press and the sheet of its skin."""
    skin = SPECS[name].skin
    return press_of(skin, Contact(radius, x, 0.0)), skin.sheet


def _texts(found):
    return {name for name in found if name.startswith("remark")}


def test_an_ordinary_contact_needs_no_remark():
    made, sheet = pressed("icub", 10.0)
    assert remarks(made, 0.0, sheet) == {}
    found = remarks(made, 5.0, sheet)
    assert _texts(found) == set()
    assert found["contact_radius_cells"] == pytest.approx(math.sqrt(np.count_nonzero(made(5.0).pressure_mpa) / math.pi))


@pytest.mark.parametrize(
    ("name", "radius", "force", "x", "expected"),
    [
        ("icub", 1.0, 1.0, 0.0, {"remark contact"}),
        ("biotac", 10.0, 500.0, -5.0, {"remark load", "remark core"}),
        ("biotac", 10.0, 1.0, 6.0, {"remark dome"}),
        ("icub", 10.0, 2.0, 8.5, {"remark edge"}),
        ("icub", 1e3, 2000.0, 3.0, {"remark load", "remark depth"}),
        ("icub", 2.0, 4.0, 0.0, {"remark flank"}),
    ],
)
def test_what_a_reader_must_know(name, radius, force, x, expected):
    made, sheet = pressed(name, radius, x)
    assert expected <= _texts(remarks(made, force, sheet))


def test_a_number_that_is_none_is_refused_by_its_name(specs):
    skin = specs["biotac"].skin
    changed = skin.model_copy(update={"tension": skin.tension.model_copy(update={"value": math.inf})})
    with pytest.raises(RigError, match="tension"):
        medium_of(changed, skin_grid(skin.sheet))
