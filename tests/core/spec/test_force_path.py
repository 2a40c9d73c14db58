"""A force that runs from point to point, beside the ramp that scenes have by default."""

import pytest
from pydantic import ValidationError

from tactbench.plugin import ForcePath, ForceRamp, Scene, Source

WHY = Source(tag="assumed", reference="test")


def path(times_s=(0.0, 0.5, 1.0, 2.0), forces_n=(0.0, 0.0, 3.0, 1.0)):
    return ForcePath(times_s=times_s, forces_n=forces_n, samples=100, source=WHY)


def test_a_path_that_cannot_be_run_is_refused():
    nan = float("nan")
    for times_s, forces_n in (((0.0,), (0.0,)), ((0.1, 1.0), (0.0, 0.0)), ((0.0, 0.0), (0.0, 0.0)),
                              ((0.0, 1.0), (0.0,)), ((0.0, 1.0), (0.0, -1.0)), ((0.0, 1.0), (0.0, nan))):  # fmt: skip
        with pytest.raises(ValidationError):
            path(times_s, forces_n)


def test_a_scene_keeps_its_kind_of_profile_through_a_file():
    for profile in (path(), ForceRamp()):
        scene = Scene(name="a", profile=profile)
        assert Scene.model_validate_json(scene.model_dump_json()) == scene
    assert isinstance(Scene.model_validate({"name": "a", "profile": {"samples": 5}}).profile, ForceRamp)
