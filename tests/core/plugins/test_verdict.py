"""A verdict: one number held against the one that is known."""

import dataclasses
import math

import numpy as np
import pytest

from tactbench.core.plugins import interfaces
from tactbench.core.plugins.interfaces import Verdict


@pytest.mark.parametrize(
    ("found", "expected", "bound", "met"),
    [(1.0, 2.0, 1.0, True), (3.0, 2.0, 1.0, True), (3.5, 2.0, 1.0, False), (0.5, 2.0, 1.0, False),
     (math.inf, 0.0, 1.0, False), (math.nan, 0.0, math.inf, False)],
)  # fmt: skip
def test_it_is_met_by_a_number_within_the_bound_which_is_included(found, expected, bound, met):
    assert Verdict("depth", found, expected, bound).met is met
    assert Verdict("depth", np.asarray(found), expected, bound).met is met


def test_what_plugins_and_rigs_exchange_cannot_be_changed():
    found = [one for one in vars(interfaces).values() if dataclasses.is_dataclass(one)]
    assert len(found) > 5
    assert [one.__name__ for one in found if not one.__dataclass_params__.frozen] == []
    assert interfaces.RigCheck((), ()).travel_ceiling_n == 0.0, "no force is allowed where a rig states none"
