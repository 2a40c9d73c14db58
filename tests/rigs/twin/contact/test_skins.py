"""What a skin must state before it is pressed."""

from __future__ import annotations

import math

import pytest

from tactbench.plugin import RigError
from tactbench.rigs.twin.contact.pressing import medium_of
from tactbench.rigs.twin.geometry import skin_grid


@pytest.mark.parametrize(
    ("name", "parameter", "value"),
    [
        ("biotac", "tension", math.inf), ("biotac", "clamp_length", 0.0), ("biotac", "residual_film", math.nan),
        ("icub", "cover_bending", -1.0), ("icub", "shear", math.nan),
    ],
)  # fmt: skip
def test_a_number_that_is_none_is_refused_by_name(specs, name, parameter, value):
    skin = specs[name].skin
    changed = skin.model_copy(update={parameter: getattr(skin, parameter).model_copy(update={"value": value})})
    with pytest.raises(RigError, match=parameter) as refused:
        medium_of(changed, skin_grid(skin.sheet))
    assert refused.value.hint


@pytest.mark.parametrize("change", [{"cells": (48, 3)}, {"cells": (0, 0)}, {"arc": -1.0}, {"x_max": -20.0}])
def test_a_sheet_that_is_none_is_refused(specs, change):
    sheet = specs["biotac"].skin.sheet
    made = {
        name: value if name == "cells" else sheet.arc.model_copy(update={"value": value})
        for name, value in change.items()
    }
    with pytest.raises(RigError, match="sheet"):
        skin_grid(sheet.model_copy(update=made))
