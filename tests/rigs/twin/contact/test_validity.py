"""What is refused and what is remarked on when a contact leaves the model's ground."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.plugin import RigError
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.validity import check_reach, remarks
from tactbench.rigs.twin.geometry import Contact, gap_mm, pad_of


@pytest.fixture(scope="module")
def press(medium, specs):
    def make(name, radius, x=0.0, s=0.0, tilt=0.0):
        made = medium(name)
        sheet = specs[name].skin.sheet
        outer = sheet.outer_radius.to("mm")
        contact = Contact(radius, x, s, tilt)
        return Press(made, gap_mm(made.grid, contact, outer), contact), outer, pad_of(sheet, made.grid)

    return make


def test_a_contact_on_the_dome_says_that_nothing_real_was_held_against_it(press, specs):
    for x, told in ((-5.0, False), (6.0, True)):
        made, outer, _ = press("biotac", 10.0, x)
        sheet = specs["biotac"].skin.sheet
        found = remarks(made, [1.0], outer, dome=sheet.dome, relief=sheet.relief)
        assert ("remark dome" in found) == told


def _texts(found):
    return {name for name in found if name.startswith("remark")}


def test_an_ordinary_contact_needs_no_remark(press):
    made, outer, pad = press("icub", 10.0)
    found = remarks(made, [0.0, 0.01, 0.5, 5.0], outer, pad)
    assert _texts(found) == set()
    assert found["contact_radius_cells"] == pytest.approx(math.sqrt(np.count_nonzero(made(5.0).pressure_mpa) / math.pi))
    assert found["resolved_above_n"] == 0.5


def test_a_contact_of_a_few_cells_says_so(press):
    made, outer, pad = press("icub", 1.0)
    found = remarks(made, [0.2, 1.0], outer, pad)
    assert "follows the mesh" in found["remark contact"]
    assert "resolved_above_n" not in found


@pytest.mark.parametrize(
    ("name", "radius", "force", "x", "expected"),
    [
        ("icub", 10.0, 50.0, 0.0, {"remark load"}),
        ("biotac", 10.0, 500.0, -5.0, {"remark load", "remark core"}),
        ("icub", 10.0, 2.0, 8.5, {"remark edge"}),
        ("icub", 1e3, 2000.0, 3.0, {"remark load", "remark depth"}),
        ("icub", 2.0, 4.0, 0.0, {"remark flank"}),
    ],
)
def test_what_a_reader_must_know(press, name, radius, force, x, expected):
    made, outer, pad = press(name, radius, x)
    assert expected <= _texts(remarks(made, [force], outer, pad))


def test_a_cap_pressed_in_past_its_rim_is_refused(press):
    made, outer, _ = press("biotac", 1.0, -5.0)
    check_reach(made, 5.0, outer)
    with pytest.raises(RigError, match="past its rim") as refused:
        check_reach(made, 500.0, outer)
    assert refused.value.hint


def test_no_load_needs_no_remark(press):
    made, outer, pad = press("icub", 10.0)
    check_reach(made, 0.0, outer)
    assert remarks(made, [0.0], outer, pad) == {}
