"""Where on the skin it touches, asked of presses of the twin at scattered places."""

import numpy as np
import pytest

from tactbench.core.errors import NotApplicable
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality
from tactbench.plugin import Placement, assumed
from tactbench.plugin.simulation import Slide
from tactbench.tasks import contact_location
from tactbench.tasks.contact_location import LOCATION_SCENES, REACH_MM
from tests.core.evaluation.made import evaluated

from .made import REGISTRY, recorded, twin

SENSORS = ["biotac", "icub"]
FIRST = LOCATION_SCENES[0].scene


@pytest.fixture(scope="module")
def presses(tmp_path_factory):
    """Two training sessions and one test session: a quarter of the campaign."""
    planned = [item for item in LOCATION_SCENES if item.scene.session in ("train-1", "train-2", "test-1")]
    return recorded("icub", tmp_path_factory.mktemp("icub"), planned)


def run(paths, estimator):
    return evaluated(contact_location.SPEC, paths, estimator, split="roles")


def test_the_place_is_found(presses):
    """From 20 places on a square of 10 mm, two millimetres apart: half of that is within reach, chance is 3.8 mm."""
    result, mean = run(presses, "forest-10"), run(presses, "mean")
    assert mean.score > 3.0
    assert result.scores["median error"] < 1.5
    assert result.score < mean.score / 2


def test_the_reference_is_where_the_indenter_was_put(presses):
    for path in presses[:3]:
        with open_recording(path) as recording:
            place = recording.read("contact_point")
            drawn, hold = recording.meta.drawn, recording.meta.scene.profile.hold_s
            force_n = recording.read("force_torque").data
        missing = np.asarray(place.quality) & Quality.MISSING
        pressing = 1e-9 * (place.t_ns - place.t_ns[0]) > hold
        np.testing.assert_array_equal(missing[:, 0] == 0, pressing)
        np.testing.assert_allclose(1e3 * place.data[pressing, 0], drawn["placed_x_mm"], rtol=1e-12)
        np.testing.assert_allclose(1e3 * place.data[pressing, 1], drawn["placed_s_mm"], rtol=1e-12)
        assert len(force_n) == len(place.data)


def test_a_slide_has_no_place():
    scene = FIRST.model_copy(update={"slide": Slide(speed=assumed(5.0, "mm/s", "a test"))})
    with (
        pytest.raises(NotApplicable, match="slide"),
        twin().open(REGISTRY.sensors["icub"], scene, seed=1),
    ):
        pass


def test_the_places_are_scattered_evenly_and_none_is_shared():
    where = np.array([[item.scene.placement.x.to("mm"), item.scene.placement.s.to("mm")] for item in LOCATION_SCENES])
    assert len(np.unique(where, axis=0)) == len(where) == len({item.scene.name for item in LOCATION_SCENES})
    assert np.abs(where).max() < REACH_MM
    roles = np.array([item.role for item in LOCATION_SCENES])
    for role in ("train", "validation", "test"):
        quadrants = np.unique(where[roles == role] > 0, axis=0, return_counts=True)[1]
        assert len(quadrants) == 4
        assert quadrants.min() >= 0.15 * quadrants.sum(), "a quarter each, within what few points allow"


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("corner", [(-1, -1), (1, 1)])
def test_no_place_is_beyond_what_the_twin_answers_for(sensor, corner):
    x, s = (assumed(sign * REACH_MM, "mm", "a corner") for sign in corner)
    scene = FIRST.model_copy(update={"placement": Placement(x=x, s=s)})
    with twin().open(REGISTRY.sensors[sensor], scene, seed=1) as acquisition:
        blocks = list(acquisition)
    assert not [name for name in acquisition.drawn if name.startswith("remark")]
    taxels = [block for block in blocks if block.stream not in ("force_torque", "contact_point")]
    assert not any(block.quality is not None and (block.quality & Quality.SATURATED).any() for block in taxels)
