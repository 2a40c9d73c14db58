"""A force over time: its corners, its hold, and its way through a file."""

import pytest

from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import Scene
from tactbench.plugin import ForcePath, ForceRamp, Source

PATH = ForcePath(
    times_s=(0.0, 0.5, 1.0, 2.0),
    forces_n=(0.5, 0.5, 3.0, 1.0),
    samples=100,
    source=Source(tag="assumed", reference="a"),
)


def ramp(hold_s):
    return ForceRamp(start=assumed(3.0, "N", "a"), hold=assumed(hold_s, "s", "a"))


@pytest.mark.parametrize(
    ("profile", "hold_s", "largest_n", "corners"),
    [
        (PATH, 0.5, 3.0, (PATH.times_s, PATH.forces_n)),
        (ramp(6), 6.0, 5.0, ((0.0, 6.0, 60.0), (3.0, 3.0, 5.0))),
        (ramp(60), 60.0, 5.0, ((0.0, 60.0), (3.0, 3.0))),
        (ramp(70), 60.0, 5.0, ((0.0, 60.0), (3.0, 3.0))),
    ],
)
def test_where_a_profile_begins_rests_and_ends(profile, hold_s, largest_n, corners):
    assert (profile.hold_s, profile.largest_n, profile.corners) == (hold_s, largest_n, corners)
    assert profile.duration.to("s") == corners[0][-1]
    scene = Scene(name="a", profile=profile)
    assert Scene.model_validate_json(scene.model_dump_json()) == scene


def test_a_profile_that_states_no_kind_is_a_ramp():
    assert isinstance(Scene.model_validate({"name": "a", "profile": {"samples": 5}}).profile, ForceRamp)
