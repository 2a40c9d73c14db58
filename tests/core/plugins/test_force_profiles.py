"""Force profiles by name: what scenes hold is a path that needs no plugin."""

import numpy as np
import pytest

from tactbench.core.errors import PluginContractError, UsageError
from tactbench.core.plugins.registry import installed
from tactbench.core.plugins.rigs import force_path
from tactbench.core.spec.quantity import assumed
from tactbench.plugin import ForcePath, ProfileDescriptor, Source


def path_of(name, **given):
    profile = installed().profiles[name]
    units = {one: parameter.unit for one, parameter in profile.parameters.items()}
    stated = {one: assumed(value, units.get(one, "1"), "a test") for one, value in given.items()}
    return force_path(profile, stated, "a test")


def test_a_staircase_goes_up_and_down_in_equal_steps():
    path = path_of("staircase", peak=3, steps=3, dwell=2, rise=0.5, hold=1, rate=10)
    middles = 1 + 2.5 * np.arange(6) + 1.5  # of every dwell
    np.testing.assert_allclose(np.interp(middles, *path.corners), [1, 2, 3, 2, 1, 0])
    assert (path.hold_s, path.times_s[-1], path.samples) == (1.0, 16.0, 160)


@pytest.mark.parametrize(
    ("name", "given", "says"),
    [
        ("sine", {"amplitude": 9}, "amplitude .* 9 N"),
        ("staircase", {"steps": 2.5}, "steps .* 2.5"),
        ("sine", {"rise": 0}, "rise .* 0 s"),
    ],
)
def test_a_parameter_that_cannot_be_is_named(name, given, says):
    with pytest.raises(UsageError, match=f"'{name}': {says}"):
        path_of(name, **given)


def nothing():
    return None


def falling():
    return ForcePath(times_s=(0, 0), forces_n=(0, 0), samples=1, source=Source(tag="assumed", reference="a test"))


@pytest.mark.parametrize("name", ["nothing", "falling"])
def test_a_plugin_that_makes_no_force_path_is_named(name):
    profile = ProfileDescriptor(name="made", title="made", where=f"{__name__}:{name}")
    with pytest.raises(PluginContractError, match="'made'"):
        force_path(profile, {}, "a test")
